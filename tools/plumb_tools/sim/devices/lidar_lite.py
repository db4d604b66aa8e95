"""A flight's ranges as the I2C transfers of a host that reads a Garmin LIDAR-Lite v3.

Facts: register map of the LIDAR-Lite v3 operation manual ("Control register list", as in Garmin's Arduino library
e2d43ad, LIDARLite.cpp) and Garmin's "LLv3 I2C guidelines" (a register read is a one-byte write, STOP and a read; a
register write is one transfer). Distances are in cm, high byte first.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from plumb_tools.sim.devices.flight_protocol import Flight

ADDRESS = 0x62

REG_ACQ_COMMAND = 0x00
REG_STATUS = 0x01
REG_SIG_COUNT_VAL = 0x02
REG_ACQ_CONFIG = 0x04
REG_PEAK_CORR = 0x0C
REG_SIGNAL_STRENGTH = 0x0E
REG_THRESHOLD_BYPASS = 0x1C
REG_FULL_DELAY = 0x8F  # 0x0f with the auto-increment flag

COMMAND_MEASURE = 0x04  # with receiver bias correction

STATUS_BUSY = 0x01
STATUS_INVALID = 0x08  # no peak found
STATUS_HEALTH = 0x20  # 1 is good

#: Garmin's "balanced" preset.
_PRESET = ((REG_SIG_COUNT_VAL, 0x80), (REG_ACQ_CONFIG, 0x08), (REG_THRESHOLD_BYPASS, 0x00))
_LONGEST_CYCLE_OVERHEAD_NS = 2_000_000  # what comes after a measurement, and some room before the next


@dataclass(frozen=True)
class LidarLiteSettings:
    """The device and the manners of its host."""

    bus_hz: int = 400_000
    acquisition_ns: int = 8_000_000  #: from the command to the end of busy; 2 to 20 ms are usual at 0x80 acquisitions
    poll_period_ns: int = 1_500_000
    pause_ns: int = 20_000  #: of the host between two transfers
    max_range_m: float = 40.0
    #: What the device reports without a return; units of another family say 0. Twenty zeros in a row are also the sign
    #: of a stuck device.
    no_return_cm: int = 1
    signal_strength: int = 120  #: of a return; a driver takes 24 or less for none
    peak_correlation: int = 180  #: of a return; 135 to 234 are usable


@dataclass(frozen=True)
class I2cTransfer:
    """One transfer on the bus, START to STOP."""

    time_ns: int  #: STOP
    duration_ns: int
    is_read: bool
    data: bytes  #: read, or written with the register first


def transfer_duration_ns(data_bytes: int, bus_hz: int) -> int:
    """START, address and data with their acknowledge bits, STOP."""
    return round((9 * (data_bytes + 1) + 2) * 1e9 / bus_hz)


class _Host:
    """Puts transfers one after the other on the bus."""

    def __init__(self, settings: LidarLiteSettings) -> None:
        self._settings = settings

    def _duration_ns(self, data: bytes) -> int:
        return transfer_duration_ns(len(data), self._settings.bus_hz)

    def write(self, stop_ns: int, register: int, value: int) -> I2cTransfer:
        data = bytes([register, value])
        return I2cTransfer(stop_ns, self._duration_ns(data), False, data)

    def read(self, stop_ns: int, register: int, data: bytes) -> tuple[I2cTransfer, I2cTransfer]:
        """The two transfers of a register read of which the second ends at the given time."""
        read = I2cTransfer(stop_ns, self._duration_ns(data), True, data)
        pointer = bytes([register])
        pointer_stop_ns = stop_ns - read.duration_ns - self._settings.pause_ns
        return I2cTransfer(pointer_stop_ns, self._duration_ns(pointer), False, pointer), read

    def read_duration_ns(self, data_bytes: int) -> int:
        """From the end of whatever was before to the end of a register read."""
        transfers = transfer_duration_ns(1, self._settings.bus_hz) + transfer_duration_ns(
            data_bytes, self._settings.bus_hz
        )
        return transfers + 2 * self._settings.pause_ns


def set_up(end_ns: int, settings: LidarLiteSettings) -> list[I2cTransfer]:
    """The preset's registers written and the first of them read back, until the given time."""
    host = _Host(settings)
    register, value = _PRESET[0]
    transfers = list(host.read(end_ns, register, bytes([value])))
    stop_ns = end_ns - host.read_duration_ns(1)
    for register, value in reversed(_PRESET):
        transfers.insert(0, host.write(stop_ns, register, value))
        stop_ns -= transfers[0].duration_ns + settings.pause_ns
    return transfers


def distance_cm(range_m: float, settings: LidarLiteSettings) -> int | None:
    """What the device measures [cm]; None without a return. A range of 0 is no return."""
    if not 0.0 < range_m <= settings.max_range_m:
        return None
    return round(range_m * 100.0)


def measurement(t_ns: int, range_m: float, acquisition_ns: int, settings: LidarLiteSettings) -> list[I2cTransfer]:
    """One cycle: command, polls of the status until it is not busy, distance, signal strength, correlation peak.

    The STOP of the command and the STOP of the first status that is not busy lie evenly about the measurement's time.
    """
    host = _Host(settings)
    distance = distance_cm(range_m, settings)
    ready = STATUS_HEALTH if distance is not None else STATUS_HEALTH | STATUS_INVALID
    command_ns, ready_ns = t_ns - acquisition_ns // 2, t_ns + acquisition_ns // 2

    polls: list[I2cTransfer] = []
    poll_ns, status = ready_ns, ready
    while poll_ns - host.read_duration_ns(1) >= command_ns:
        polls[:0] = host.read(poll_ns, REG_STATUS, bytes([status]))
        poll_ns, status = poll_ns - settings.poll_period_ns, STATUS_HEALTH | STATUS_BUSY
    transfers = [host.write(command_ns, REG_ACQ_COMMAND, COMMAND_MEASURE), *polls]

    strength, peak = (settings.signal_strength, settings.peak_correlation) if distance is not None else (0, 0)
    reported_cm = settings.no_return_cm if distance is None else distance
    for register, data in (
        (REG_FULL_DELAY, reported_cm.to_bytes(2, "big")),
        (REG_SIGNAL_STRENGTH, bytes([strength])),
        (REG_PEAK_CORR, bytes([peak])),
    ):
        stop_ns = transfers[-1].time_ns + host.read_duration_ns(len(data))
        transfers += host.read(stop_ns, register, data)
    return transfers


def i2c_transfers(flight: Flight, settings: LidarLiteSettings) -> Iterator[I2cTransfer]:
    """The set-up of the device and a measurement cycle for every range of the flight."""
    if len(flight.range_t_ns) == 0:
        return
    acquisition_ns = settings.acquisition_ns
    if len(flight.range_t_ns) > 1:
        spacing_ns = int(np.min(np.diff(flight.range_t_ns)))
        acquisition_ns = min(acquisition_ns, spacing_ns - _LONGEST_CYCLE_OVERHEAD_NS)
    if acquisition_ns < _LONGEST_CYCLE_OVERHEAD_NS:
        raise ValueError(f"range_t_ns: ranges {spacing_ns / 1e6:.3f} ms apart, too close for a LIDAR-Lite v3")
    first_ns = int(flight.range_t_ns[0]) - acquisition_ns // 2
    yield from set_up(first_ns - _LONGEST_CYCLE_OVERHEAD_NS, settings)
    for t_ns, range_m in zip(flight.range_t_ns.tolist(), flight.range_m.tolist(), strict=True):
        yield from measurement(t_ns, range_m, acquisition_ns, settings)
