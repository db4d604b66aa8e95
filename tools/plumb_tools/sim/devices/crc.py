"""Checksums of the devices: most significant bit first, not reflected, no final exclusive or."""

from __future__ import annotations


def _table(polynomial: int, width: int) -> tuple[int, ...]:
    """Remainders of every byte value."""
    top, mask = 1 << (width - 1), (1 << width) - 1
    remainders = []
    for byte in range(256):
        remainder = byte << (width - 8)
        for _ in range(8):
            remainder = ((remainder << 1) ^ polynomial if remainder & top else remainder << 1) & mask
        remainders.append(remainder)
    return tuple(remainders)


_TABLE_32 = _table(0x04C11DB7, 32)
_TABLE_16 = _table(0x1021, 16)


def crc32_mpeg2(data: bytes) -> int:
    """CRC-32/MPEG-2, the checksum of the STIM300 (TS1524 rev.31, section 5.5.7, page 37). It is not zlib's."""
    remainder = 0xFFFFFFFF
    for byte in data:
        remainder = ((remainder << 8) & 0xFFFFFFFF) ^ _TABLE_32[(remainder >> 24) ^ byte]
    return remainder


def crc16_ccitt_false(data: bytes) -> int:
    """CRC-16/CCITT-FALSE, the checksum of a DroneCAN transfer."""
    remainder = 0xFFFF
    for byte in data:
        remainder = ((remainder << 8) & 0xFFFF) ^ _TABLE_16[(remainder >> 8) ^ byte]
    return remainder
