"""A flight's inertial samples as the byte stream of a STIM300, from power-on.

Facts: data sheet TS1524 rev.31, status byte (table 5-23, page 38) and section 7.5.2.2 (scale factors, counter, latency;
pages 48 to 55). Step of the counter, start-up status and the gyros' saturation also as in a public capture of a real
unit (UBC-Rocket/Whistler-Blackcomb-v2, data/imu).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from plumb_tools.sim.devices.flight_protocol import Flight, FloatArray, IntArray
from plumb_tools.sim.devices.stim300 import (
    INTERNAL_RATE_HZ,
    RATE_CODES,
    STATUS_OVERLOAD,
    STATUS_STARTING,
    Cluster,
    NormalDatagram,
    Stim300Settings,
    configuration_datagram,
    part_number_datagram,
    serial_number_datagram,
    wire_time_ns,
)

#: What the unit takes for g [m/s^2].
STANDARD_GRAVITY = 9.80665

_GYRO_LIMIT_DEG_S = 480.0
# Scale: counts per unit are 2 to the power of these.
_GYRO_RATE_BITS = 14  # deg/s
_GYRO_INCREMENT_BITS = 21  # deg
_ACCEL_BITS = {5: 20, 10: 19, 30: 18, 80: 16}  # g, by range
_VELOCITY_INCREMENT_BITS = {5: 23, 10: 22, 30: 21, 80: 19}  # m/s, by range
# Overload is flagged from here on [g]; only the 80 g range is clipped there too.
_ACCEL_OVERLOAD_G = {5: 5.5, 10: 11.0, 30: 33.0, 80: 96.0}
_MAX_COUNT = (1 << 23) - 1

# The first datagrams of a real unit carried these status bytes and saturated gyros; then 0x40 alone until it was ready.
_FIRST_STATUS = (0xFF, 0xEF, 0x5F, 0x4C, 0x49)
_FIRST_GYRO = (0x780000, 0x780000, -0x780000)
_SPECIALS_GAP_NS = 1_000_000  # between the last special datagram and the first normal one
_RATE_TOLERANCE = 0.02


@dataclass(frozen=True)
class SerialChunk:
    """Bytes that one read of the serial line returned."""

    time_ns: int  #: arrival of the last byte
    data: bytes


def sample_rate_hz(t_ns: IntArray) -> int:
    """The sample rate of the unit that the stamps fit; ValueError where there is none."""
    measured_hz = 1e9 / float(np.median(np.diff(t_ns)))
    nearest = min(RATE_CODES, key=lambda rate: abs(rate - measured_hz))
    if abs(measured_hz / nearest - 1.0) > _RATE_TOLERANCE:
        rates = ", ".join(str(rate) for rate in RATE_CODES)
        raise ValueError(f"imu_t_ns: samples at {measured_hz:.0f} Hz; a STIM300 sends at {rates} Hz")
    return nearest


def _status(overload: np.ndarray) -> IntArray:
    """Status bytes (N,) of overloaded axes (N, 3)."""
    axes = overload.astype(np.int64) @ np.array([1, 2, 4])
    return np.where(axes > 0, STATUS_OVERLOAD | axes, 0)


def gyro_counts(gyro_rad_s: FloatArray, rate_hz: int, settings: Stim300Settings) -> tuple[IntArray, IntArray]:
    """Counts (N, 3) and status (N,) of angular rates (N, 3)."""
    deg_s = np.degrees(gyro_rad_s)
    status = _status(np.abs(deg_s) >= _GYRO_LIMIT_DEG_S)
    deg_s = np.clip(deg_s, -_GYRO_LIMIT_DEG_S, _GYRO_LIMIT_DEG_S)
    if settings.incremental:
        return np.rint(deg_s / rate_hz * 2.0**_GYRO_INCREMENT_BITS).astype(np.int64), status
    return np.rint(deg_s * 2.0**_GYRO_RATE_BITS).astype(np.int64), status


def accel_counts(accel_m_s2: FloatArray, rate_hz: int, settings: Stim300Settings) -> tuple[IntArray, IntArray]:
    """Counts (N, 3) and status (N,) of specific forces (N, 3)."""
    limit_g = _ACCEL_OVERLOAD_G[settings.accel_range_g]
    accel_g = accel_m_s2 / STANDARD_GRAVITY
    status = _status(np.abs(accel_g) >= limit_g)
    if settings.accel_range_g == 80:
        accel_g = np.clip(accel_g, -limit_g, limit_g)
    if settings.incremental:
        increment_m_s = accel_g * STANDARD_GRAVITY / rate_hz
        counts = np.rint(increment_m_s * 2.0 ** _VELOCITY_INCREMENT_BITS[settings.accel_range_g])
    else:
        counts = np.rint(accel_g * 2.0 ** _ACCEL_BITS[settings.accel_range_g])
    return np.clip(counts, -_MAX_COUNT - 1, _MAX_COUNT).astype(np.int64), status


def _counters(t_ns: IntArray, rate_hz: int, first: int) -> IntArray:
    """Counter (N,) of the datagrams; it steps over samples that are missing from the flight."""
    periods = np.maximum(np.rint(np.diff(t_ns) * (rate_hz * 1e-9)), 1.0).astype(np.int64)
    steps = np.concatenate([[first], periods * (INTERNAL_RATE_HZ // rate_hz)])
    return np.cumsum(steps) % 256


def _special_chunks(t_end_ns: int, rate_hz: int, settings: Stim300Settings) -> Iterator[SerialChunk]:
    """What a unit says of itself at power-on, the last byte at the given time."""
    specials = [
        part_number_datagram(settings),
        serial_number_datagram(settings),
        configuration_datagram(settings, rate_hz),
    ]
    t_ns = t_end_ns - sum(wire_time_ns(len(data), settings.baud) for data in specials)
    for data in specials:
        t_ns += wire_time_ns(len(data), settings.baud)
        yield SerialChunk(t_ns, data)


def serial_chunks(flight: Flight, settings: Stim300Settings) -> Iterator[SerialChunk]:
    """Part number, serial number, configuration, start-up datagrams and then a datagram per sample, each in one read.

    A sample's datagram arrives at its stamp + group delay + latency + time on the wire. The start-up datagrams repeat
    the first sample, marked as not valid yet.
    """
    rate_hz = sample_rate_hz(flight.imu_t_ns)
    gyro, gyro_status = gyro_counts(flight.imu_gyro_rad_s, rate_hz, settings)
    accel, accel_status = accel_counts(flight.imu_accel_m_s2, rate_hz, settings)

    def datagram(i: int, counter: int) -> NormalDatagram:
        return NormalDatagram(
            Cluster(tuple(gyro[i].tolist()), int(gyro_status[i])),
            counter,
            settings.latency_us,
            Cluster(tuple(accel[i].tolist()), int(accel_status[i])),
        )

    wire_ns = wire_time_ns(len(datagram(0, 0).encode(settings.crlf)), settings.baud)
    delay_ns = settings.group_delay_ns + settings.latency_us * 1000 + wire_ns
    t_first_ns = int(flight.imu_t_ns[0]) + delay_ns
    period_ns = 1_000_000_000 // rate_hz
    # Nothing arrives before the zero of the clock.
    room = max(0, (t_first_ns - wire_ns - 5 * _SPECIALS_GAP_NS) // period_ns)
    startup_count = min(round(settings.startup_s * rate_hz), room)
    t_power_on_ns = t_first_ns - startup_count * period_ns - wire_ns - _SPECIALS_GAP_NS
    yield from _special_chunks(t_power_on_ns, rate_hz, settings)

    step = INTERNAL_RATE_HZ // rate_hz
    for k in range(startup_count):
        status = _FIRST_STATUS[k] if k < len(_FIRST_STATUS) else STATUS_STARTING
        counts = _FIRST_GYRO if k < len(_FIRST_STATUS) else tuple(gyro[0].tolist())
        starting = NormalDatagram(
            Cluster(counts, status),
            step * (k + 1) % 256,
            settings.latency_us,
            Cluster(tuple(accel[0].tolist()), status),
        )
        yield SerialChunk(t_first_ns - (startup_count - k) * period_ns, starting.encode(settings.crlf))
    counters = _counters(flight.imu_t_ns, rate_hz, step * (startup_count + 1)).tolist()
    for i, (t_ns, counter) in enumerate(zip(flight.imu_t_ns.tolist(), counters, strict=True)):
        yield SerialChunk(t_ns + delay_ns, datagram(i, counter).encode(settings.crlf))
