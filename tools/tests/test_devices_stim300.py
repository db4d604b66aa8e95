"""STIM300 bytes, read by a decoder of its own written from the data sheet (TS1524 rev.31), and by real units' bytes."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from devices_flight import MadeUpFlight, made_up_flight
from plumb_tools.sim.devices.crc import crc32_mpeg2
from plumb_tools.sim.devices.stim300 import (
    Cluster,
    NormalDatagram,
    Stim300Settings,
    configuration_datagram,
    serial_number_datagram,
    wire_time_ns,
)
from plumb_tools.sim.devices.stim300_stream import SerialChunk, serial_chunks

# Identifier: accelerometer, inclinometer, temperatures, PPS, bytes in all without CR LF (table 5-21).
CONTENTS = {
    0x90: (0, 0, 0, 0, 18),
    0x91: (1, 0, 0, 0, 28),
    0x92: (0, 1, 0, 0, 28),
    0x93: (1, 1, 0, 0, 38),
    0x94: (0, 0, 1, 0, 25),
    0xA5: (1, 0, 1, 0, 42),
    0xA6: (0, 1, 1, 0, 42),
    0xA7: (1, 1, 1, 0, 59),
    0xF0: (0, 0, 0, 1, 22),
    0xF1: (1, 0, 0, 1, 32),
    0xF2: (0, 1, 0, 1, 32),
    0xF3: (1, 1, 0, 1, 42),
    0xF4: (0, 0, 1, 1, 29),
    0xF5: (1, 0, 1, 1, 46),
    0xF6: (0, 1, 1, 1, 46),
    0xF7: (1, 1, 1, 1, 63),
}
SPECIAL_BYTES = {0xB1: 20, 0xB3: 20, 0xB5: 20, 0xB7: 20, 0xBC: 26, 0xBD: 26}

R1 = "93fffbdb00007cfffcc4000005ce0001f6040e540000539dffb2b7402d99004101fb6073e3de0d0a"
REAL = {
    "R1": R1,
    "R2": "93000182000473fff75c000007b2fff87e0405bf0000610affd8d2401394005101fa8c3d470f0d0a",
    "R3": "93fffb9dfffcc100040d0000031800010404043e00004b4400166d4015b4006101fa503c18b00d0a",
    "R4": "93780000780000880000ff00b5d8ff871700367eef7fffff4f1ff6800000ff0101fa2f7d41270d0a",
    "R5": "930013befb6762fd90dc400173e10026fd03a9c440184ed10241fb3ac254403201fa2623338c0d0a",
    "R6": "93001204fb7159fd8eb30001752500221f03a7d800184f4d0249893ac6b0003303f492fde7100d0a",
}
A = "91004000ffe00000000100000000f80000040000000801fa732bc1ae"
COMPUTED = {
    "A": A,
    "B": "91200000e0000000020c00400000ff5f607fffff141001fb1ee29a9a0d0a",
    "C": "a58000007fffff00000040100000f00000080000401900d80000804019001901ffff40ff03f56ae986b4",
    "D": "f70000640000c800012c000003e80007d00800000000000a0000144000000023a023c023a0002319230a231c00239523b6239500"
    "01e24000e101faa96969fd",
}
CONFIGURATION = "bc4b0022217844407044407044420c000000000000002dea6823"
SERIAL_NUMBER = "b54e25582405002002000000000000002d58731d"


def crc_bit_by_bit(data: bytes) -> int:
    """Polynomial division, one bit after the other."""
    remainder = 0xFFFFFFFF
    for byte in data:
        for bit in range(7, -1, -1):
            carry = remainder >> 31 ^ byte >> bit & 1
            remainder = remainder << 1 & 0xFFFFFFFF
            if carry:
                remainder ^= 0x04C11DB7
    return remainder


def crc_holds(datagram: bytes) -> bool:
    body = datagram[:-4]
    while len(body) % 4:
        body += b"\0"
    return crc_bit_by_bit(body) == int.from_bytes(datagram[-4:], "big")


@dataclass
class Decoded:
    identifier: int
    clusters: list[tuple[list[int], int]]
    counter: int
    latency_us: int


def decode(datagram: bytes) -> Decoded:
    """Numbers of a normal datagram without its CR LF."""
    has_accel, has_incl, has_temp, has_pps, length = CONTENTS[datagram[0]]
    assert len(datagram) == length
    inertial = 1 + has_accel + has_incl
    shapes = [(3, 3)] * inertial + [(3, 2)] * (inertial * has_temp) + [(1, 3)] * has_pps
    clusters, at = [], 1
    for numbers, width in shapes:
        raw = []
        for _ in range(numbers):
            value = int.from_bytes(datagram[at : at + width], "big")
            raw.append(value - (1 << 8 * width) if value >> (8 * width - 1) else value)
            at += width
        clusters.append((raw, datagram[at]))
        at += 1
    return Decoded(datagram[0], clusters, datagram[at], datagram[at + 1] << 8 | datagram[at + 2])


def re_encode(decoded: Decoded, crlf: bool) -> bytes:
    has_accel, has_incl, has_temp, has_pps, _ = CONTENTS[decoded.identifier]
    clusters = [Cluster(tuple(raw), status) for raw, status in decoded.clusters]
    gyro = clusters.pop(0)
    accel = clusters.pop(0) if has_accel else None
    inclinometer = clusters.pop(0) if has_incl else None
    pps = clusters.pop() if has_pps else None
    assert bool(clusters) == bool(has_temp)
    datagram = NormalDatagram(gyro, decoded.counter, decoded.latency_us, accel, inclinometer, tuple(clusters), pps)
    return datagram.encode(crlf)


def split(chunks: list[SerialChunk], crlf: bool) -> list[tuple[int, bytes]]:
    """Arrival and bytes of every datagram, found in the stream by identifier, length and checksum."""
    stream = b"".join(chunk.data for chunk in chunks)
    arrival = {}
    end = 0
    for chunk in chunks:
        end += len(chunk.data)
        arrival[end] = chunk.time_ns
    found, at = [], 0
    while at < len(stream):
        length = SPECIAL_BYTES.get(stream[at]) or CONTENTS[stream[at]][4]
        datagram = stream[at : at + length]
        assert crc_holds(datagram)
        at += length
        if crlf:
            assert stream[at : at + 2] == b"\r\n"
            at += 2
        found.append((arrival[at], datagram))
    return found


def sample_datagrams(flight: MadeUpFlight, settings: Stim300Settings) -> list[tuple[int, Decoded]]:
    """Those of the flight's samples, without the start-up phase."""
    datagrams = split(list(serial_chunks(flight, settings)), settings.crlf)
    normal = [(t_ns, decode(data)) for t_ns, data in datagrams if data[0] in CONTENTS]
    return normal[-len(flight.imu_t_ns) :]


def test_checksum_has_the_check_values_of_its_catalogue_entry() -> None:
    assert crc32_mpeg2(b"123456789") == 0x0376E6E7
    assert crc32_mpeg2(b"\0") == 0x4E08BFB4


@pytest.mark.parametrize("name", [*REAL, *COMPUTED])
def test_datagrams_of_the_reference_are_encoded_to_the_byte(name: str) -> None:
    expected = bytes.fromhex((REAL | COMPUTED)[name])
    crlf = expected.endswith(b"\r\n")
    bare = expected[:-2] if crlf else expected
    assert crc_holds(bare)
    assert re_encode(decode(bare), crlf) == expected


def test_the_decoder_of_this_test_reads_what_the_reference_says() -> None:
    r1 = decode(bytes.fromhex(R1)[:-2])
    assert r1.clusters == [([-1061, 124, -828], 0), ([1486, 502, 265812], 0), ([21405, -19785, 4205977], 0)]
    assert (r1.counter, r1.latency_us) == (65, 507)
    everything = decode(bytes.fromhex(COMPUTED["D"]))
    assert everything.clusters[-1] == ([123456], 0)
    assert everything.clusters[3] == ([9120, 9152, 9120], 0)


def test_altered_datagrams_fail_the_checksum() -> None:
    r7 = bytearray(bytes.fromhex(R1)[:-2])
    r7[12], r7[23] = 0xC5, 0x98
    a_bad = bytearray(bytes.fromhex(A))
    a_bad[3] = 0x01
    for damaged in (bytes(r7), bytes(a_bad)):
        padded = damaged[:-4] + bytes(-(len(damaged) - 4) % 4)
        assert crc32_mpeg2(padded) != int.from_bytes(damaged[-4:], "big")
        assert not crc_holds(damaged)


def test_configuration_and_serial_number_of_the_reference() -> None:
    assert configuration_datagram(Stim300Settings(), 250) == bytes.fromhex(CONFIGURATION)
    assert serial_number_datagram(Stim300Settings()) == bytes.fromhex(SERIAL_NUMBER)


def test_configuration_tells_rate_range_units_and_line() -> None:
    settings = Stim300Settings(baud=460800, crlf=True, accel_range_g=30, incremental=True)
    datagram = configuration_datagram(settings, 500)
    assert datagram[0] == 0xBD and datagram.endswith(b"\r\n") and crc_holds(datagram[:-2])
    assert datagram[3] == 2 << 5 | 0b00011
    assert datagram[4] >> 4 == 1
    assert (datagram[5] & 0xF, datagram[8] & 0xF) == (9, 1)
    assert (datagram[17], datagram[18]) == (0x44, 0x40)


@pytest.mark.parametrize("identifier", CONTENTS)
def test_every_content_has_the_identifier_and_length_of_the_data_sheet(identifier: int) -> None:
    has_accel, has_incl, has_temp, has_pps, length = CONTENTS[identifier]
    three = Cluster((1, -2, 3), 0x10)
    datagram = NormalDatagram(
        gyro=three,
        counter=200,
        latency_us=1013,
        accel=three if has_accel else None,
        inclinometer=three if has_incl else None,
        temperatures=(three,) * ((1 + has_accel + has_incl) * has_temp),
        pps=Cluster((-5,), 0) if has_pps else None,
    ).encode()
    assert (datagram[0], len(datagram)) == (identifier, length)
    decoded = decode(datagram)
    assert crc_holds(datagram)
    assert decoded.clusters[0] == ([1, -2, 3], 0x10)
    assert (decoded.counter, decoded.latency_us) == (200, 1013)


def test_checksum_holds_on_the_bytes_of_a_real_unit() -> None:
    data = Path(os.environ.get("PLUMB_DATA") or Path(__file__).resolve().parents[3] / "shared" / "data")
    capture = data / "stim300" / "capture_2000hz.bin"
    if not capture.is_file():
        pytest.skip(f"recorded data not found at {capture}; set PLUMB_DATA to the folder that holds stim300")
    stream = capture.read_bytes()
    datagrams = [stream[at : at + 38] for at in range(0, len(stream) - 39, 40)]
    assert len(datagrams) == 8392
    for datagram in datagrams:
        assert crc32_mpeg2(datagram[:-4] + b"\0\0") == int.from_bytes(datagram[-4:], "big")
        assert re_encode(decode(datagram), crlf=False) == datagram


@pytest.mark.parametrize("crlf", [False, True])
@pytest.mark.parametrize("accel_range_g, accel_bits", [(5, 20), (10, 19), (30, 18), (80, 16)])
def test_rates_and_accelerations_come_back_to_half_a_count(crlf: bool, accel_range_g: int, accel_bits: int) -> None:
    flight = made_up_flight()
    flight.imu_accel_m_s2 *= 0.1
    datagrams = sample_datagrams(flight, Stim300Settings(crlf=crlf, accel_range_g=accel_range_g))
    gyro = np.array([d.clusters[0][0] for _, d in datagrams]) / 2.0**14
    accel = np.array([d.clusters[1][0] for _, d in datagrams]) / 2.0**accel_bits
    assert np.max(np.abs(gyro - np.degrees(flight.imu_gyro_rad_s))) <= 0.5001 / 2.0**14
    assert np.max(np.abs(accel - flight.imu_accel_m_s2 / 9.80665)) <= 0.5001 / 2.0**accel_bits
    assert {status for _, d in datagrams for _, status in d.clusters} == {0}


@pytest.mark.parametrize("accel_range_g, velocity_bits", [(5, 23), (10, 22), (30, 21), (80, 19)])
def test_increments_come_back_to_half_a_count(accel_range_g: int, velocity_bits: int) -> None:
    flight = made_up_flight()
    flight.imu_accel_m_s2 *= 0.1
    datagrams = sample_datagrams(flight, Stim300Settings(incremental=True, accel_range_g=accel_range_g))
    angle_deg = np.array([d.clusters[0][0] for _, d in datagrams]) / 2.0**21
    velocity_m_s = np.array([d.clusters[1][0] for _, d in datagrams]) / 2.0**velocity_bits
    assert np.max(np.abs(angle_deg - np.degrees(flight.imu_gyro_rad_s) * 0.004)) <= 0.5001 / 2.0**21
    assert np.max(np.abs(velocity_m_s - flight.imu_accel_m_s2 * 0.004)) <= 0.5001 / 2.0**velocity_bits


def test_stamps_lead_back_to_the_samples() -> None:
    flight = made_up_flight()
    settings = Stim300Settings(baud=460800, crlf=True, group_delay_ns=6_200_000)
    wire_ns = round(30 * 10 * 1e9 / 460800)
    sampled = [t_ns - wire_ns - d.latency_us * 1000 - 6_200_000 for t_ns, d in sample_datagrams(flight, settings)]
    assert sampled == flight.imu_t_ns.tolist()
    assert wire_time_ns(28, 921600) == 303_819


@pytest.mark.parametrize("rate_hz", [125, 250, 500, 1000, 2000])
def test_counter_counts_the_internal_samples(rate_hz: int) -> None:
    flight = made_up_flight(seconds=0.5)
    flight.imu_t_ns = flight.imu_t_ns[0] + np.rint(np.arange(len(flight.imu_t_ns)) * 1e9 / rate_hz).astype(np.int64)
    datagrams = [data for _, data in split(list(serial_chunks(flight, Stim300Settings())), False)]
    counters = [decode(data).counter for data in datagrams if data[0] in CONTENTS]
    assert set(np.diff(counters) % 256) == {2000 // rate_hz}


def test_counter_tells_how_many_samples_are_missing() -> None:
    flight = made_up_flight()
    keep = np.ones(len(flight.imu_t_ns), dtype=bool)
    keep[100:103] = False
    flight.imu_t_ns = flight.imu_t_ns[keep]
    flight.imu_gyro_rad_s, flight.imu_accel_m_s2 = flight.imu_gyro_rad_s[keep], flight.imu_accel_m_s2[keep]
    counters = [d.counter for _, d in sample_datagrams(flight, Stim300Settings())]
    steps = np.diff(counters) % 256
    assert steps[99] == 4 * 8
    assert np.all(np.delete(steps, 99) == 8)


def test_overload_names_the_axes_and_rates_saturate() -> None:
    flight = made_up_flight()
    flight.imu_gyro_rad_s[0] = np.radians([481.0, -600.0, 100.0])
    flight.imu_accel_m_s2[0] = np.array([0.0, 1.0, -11.5]) * 9.80665
    flight.imu_accel_m_s2[1] = np.array([40.0, 1.0, -40.0]) * 9.80665
    first, second = [d for _, d in sample_datagrams(flight, Stim300Settings())][:2]
    assert first.clusters[0] == ([0x780000, -0x780000, round(100.0 * 2**14)], 0x13)
    assert first.clusters[1] == ([0, 1 << 19, round(-11.5 * 2**19)], 0x14)
    assert second.clusters[1] == ([0x7FFFFF, 1 << 19, -0x800000], 0x15)


def test_power_on_sends_specials_then_data_that_are_not_valid_yet() -> None:
    flight = made_up_flight()
    chunks = list(serial_chunks(flight, Stim300Settings()))
    arrivals = [chunk.time_ns for chunk in chunks]
    assert arrivals == sorted(arrivals)
    datagrams = [data for _, data in split(chunks, False)]
    assert [data[0] for data in datagrams[:3]] == [0xB1, 0xB5, 0xBC]
    assert datagrams[0][1:4] == bytes.fromhex("084167")  # 84167, the 10 g unit
    starting = [decode(data) for data in datagrams[3 : -len(flight.imu_t_ns)]]
    assert len(starting) == round(0.7 * 250)
    assert all(status & 0x40 for d in starting for _, status in d.clusters)
    assert starting[0].clusters[0] == ([0x780000, 0x780000, -0x780000], 0xFF)
    assert starting[-1].clusters[0][1] == 0x40


def test_start_up_is_cut_short_at_the_zero_of_the_clock() -> None:
    flight = made_up_flight()
    flight.imu_t_ns = flight.imu_t_ns - flight.imu_t_ns[0] + 100_000_000
    chunks = list(serial_chunks(flight, Stim300Settings()))
    assert chunks[0].time_ns >= 0
    assert len(chunks) - len(flight.imu_t_ns) - 3 == 23


def test_a_rate_the_unit_does_not_have_is_refused() -> None:
    flight = made_up_flight(imu_hz=200.0)
    with pytest.raises(ValueError, match=r"imu_t_ns: samples at 200 Hz; a STIM300 sends at 125, 250, 500"):
        list(serial_chunks(flight, Stim300Settings()))
