"""Datagrams of the Sensonor STIM300 inertial measurement unit, byte for byte.

Facts: data sheet TS1524 rev.31, section 5.5: special datagrams (tables 5-13 to 5-16, pages 29 to 33), normal datagrams
(table 5-20, page 36), identifiers (table 5-21, page 37), checksum (section 5.5.7, page 37), status byte (table 5-23,
page 38). Multi-byte fields are big-endian; signed ones two's complement.
"""

from __future__ import annotations

from dataclasses import dataclass

from plumb_tools.sim.devices.crc import crc32_mpeg2

#: Status byte: bits 2 to 0 name the channels Z, Y, X.
STATUS_STARTING = 0x40
STATUS_OVERLOAD = 0x10

#: Internal samples per second, which the counter counts.
INTERNAL_RATE_HZ = 2000
#: Datagrams per second and their code in the configuration datagram.
RATE_CODES = {125: 0, 250: 1, 500: 2, 1000: 3, 2000: 4}
BAUD_CODES = {374400: 0, 460800: 1, 921600: 2, 1843200: 3}
ACCEL_RANGE_CODES = {10: 0, 5: 3, 30: 4, 80: 6}
PRODUCT_NUMBERS = {5: "84458", 10: "84167", 30: "84461", 80: "84615"}

# By content: accelerometer 1, inclinometer 2, temperature 4. With PPS the identifiers are 0xF0 to 0xF7.
_NORMAL_IDENTIFIERS = (0x90, 0x91, 0x92, 0x93, 0x94, 0xA5, 0xA6, 0xA7)
_NORMAL_IDENTIFIER_WITH_PPS = 0xF0
# Without and with CR LF.
_PART_NUMBER_IDENTIFIERS = (0xB1, 0xB3)
_SERIAL_NUMBER_IDENTIFIERS = (0xB5, 0xB7)
_CONFIGURATION_IDENTIFIERS = (0xBC, 0xBD)

_INERTIAL_BYTES = 3
_TEMPERATURE_BYTES = 2
_CR_LF = b"\r\n"


@dataclass(frozen=True)
class Stim300Settings:
    """A unit as configured, and the line it sends on."""

    baud: int = 921600  #: bit/s, one of `BAUD_CODES`
    crlf: bool = False  #: CR LF after every datagram
    accel_range_g: int = 10  #: one of `ACCEL_RANGE_CODES`
    incremental: bool = False  #: angle and velocity increments instead of angular rate and acceleration
    latency_us: int = 506  #: from the sample to the start of its transmission, told in the datagram
    #: From the motion to the sample. A simulated IMU has no filter; a real one at 262 Hz has 6.2 ms with delayed gyros.
    group_delay_ns: int = 0
    startup_s: float = 0.7  #: how long data are marked as not valid yet; shortened where the clock is still at zero
    revision: str = "K"  #: of the part: '-' or A to Z
    serial_digits: str = "25582405002002"  #: 14 digits


@dataclass(frozen=True)
class Cluster:
    """Numbers that share a status byte: one per axis, or a single one."""

    raw: tuple[int, ...]  #: signed counts
    status: int = 0

    def encode(self, bytes_per_number: int) -> bytes:
        """Numbers, then status."""
        numbers = b"".join(value.to_bytes(bytes_per_number, "big", signed=True) for value in self.raw)
        return numbers + bytes([self.status])


@dataclass(frozen=True)
class NormalDatagram:
    """One sample. Clusters that are None are not part of the datagram."""

    gyro: Cluster
    counter: int  #: internal samples, modulo 256
    latency_us: int
    accel: Cluster | None = None
    inclinometer: Cluster | None = None
    temperatures: tuple[Cluster, ...] = ()  #: none, or one for each of gyro, accelerometer, inclinometer that is sent
    pps: Cluster | None = None  #: a single number

    def identifier(self) -> int:
        """First byte, which tells the content (table 5-21)."""
        content = (self.accel is not None) | (self.inclinometer is not None) << 1 | bool(self.temperatures) << 2
        return _NORMAL_IDENTIFIERS[content] if self.pps is None else _NORMAL_IDENTIFIER_WITH_PPS + content

    def encode(self, crlf: bool = False) -> bytes:
        """The bytes on the wire."""
        inertial = [cluster for cluster in (self.gyro, self.accel, self.inclinometer) if cluster is not None]
        if self.temperatures and len(self.temperatures) != len(inertial):
            raise ValueError(f"{len(self.temperatures)} temperature clusters for {len(inertial)} inertial ones")
        body = bytes([self.identifier()])
        body += b"".join(cluster.encode(_INERTIAL_BYTES) for cluster in inertial)
        body += b"".join(cluster.encode(_TEMPERATURE_BYTES) for cluster in self.temperatures)
        if self.pps is not None:
            body += self.pps.encode(_INERTIAL_BYTES)
        return frame(body + bytes([self.counter]) + self.latency_us.to_bytes(2, "big"), crlf)


def frame(body: bytes, crlf: bool) -> bytes:
    """Adds the checksum, taken over the body padded with zeros to whole 32-bit words, and CR LF where it is on."""
    padding = bytes(-len(body) % 4)
    return body + crc32_mpeg2(body + padding).to_bytes(4, "big") + (_CR_LF if crlf else b"")


def part_number_datagram(settings: Stim300Settings) -> bytes:
    """Product number of the accelerometer range, the options left at zero (tables 5-13 and 5-14, page 29)."""
    product = bytes.fromhex("0" + PRODUCT_NUMBERS[settings.accel_range_g])
    content = product + b"-" + bytes(3) + b"-" + bytes(6) + settings.revision.encode("ascii")
    return frame(bytes([_PART_NUMBER_IDENTIFIERS[settings.crlf]]) + content, settings.crlf)


def serial_number_datagram(settings: Stim300Settings) -> bytes:
    """'N' and 14 digits, two to a byte (table 5-15, page 30)."""
    content = b"N" + bytes.fromhex(settings.serial_digits) + bytes(7)
    return frame(bytes([_SERIAL_NUMBER_IDENTIFIERS[settings.crlf]]) + content, settings.crlf)


def configuration_datagram(settings: Stim300Settings, rate_hz: int) -> bytes:
    """How the unit is set up: gyro and accelerometer, delayed gyros, all filters at 262 Hz (table 5-16, page 31)."""
    accel_code = ACCEL_RANGE_CODES[settings.accel_range_g]
    unit = 1 if settings.incremental else 0
    content = bytes(
        [
            ord(settings.revision),
            0,  # firmware revision
            RATE_CODES[rate_hz] << 5 | 0x02 | settings.crlf,  # the accelerometer is included
            BAUD_CODES[settings.baud] << 4 | 0x01,  # 1 stop bit, no parity, line termination on
            0x78 | unit,  # gyro axes X, Y, Z active; delayed
            0x44,
            0x40,  # no g-compensation
            0x70 | unit,  # accelerometer axes active
            0x44,
            0x40,
            0x70,  # inclinometer: active, though not sent
            0x44,
            0x42,  # PPS: time since detection
            0x0C,  # the unit has a PPS input, filter 262 Hz
            0,  # gyro range 400 deg/s
            0,
            accel_code << 4 | accel_code,
            accel_code << 4,
            0,  # inclinometer range 1.7 g
            0,
            0,  # TOV at 5 V, no bias-trim datagram at start-up
        ]
    )
    return frame(bytes([_CONFIGURATION_IDENTIFIERS[settings.crlf]]) + content, settings.crlf)


def wire_time_ns(byte_count: int, baud: int) -> int:
    """Time on the serial line: a start bit, 8 data bits and a stop bit to a byte."""
    return round(byte_count * 10 * 1e9 / baud)
