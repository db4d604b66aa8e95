"""LIDAR-Lite v3 transfers, read by a register machine of its own written from the register map."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from devices_flight import made_up_flight
from plumb_tools.sim.devices.lidar_lite import I2cTransfer, LidarLiteSettings, i2c_transfers, transfer_duration_ns


@dataclass
class Cycle:
    """What a host following the manual gets from one measurement."""

    t_command_ns: int
    t_ready_ns: int = 0
    polls: list[int] = field(default_factory=list)
    distance_cm: int | None = None
    strength: int | None = None
    peak: int | None = None

    @property
    def valid(self) -> bool:
        return self.polls[-1] & 0x08 == 0 and self.polls[-1] & 0x20 != 0


def read_cycles(transfers: list[I2cTransfer]) -> tuple[list[tuple[int, int]], list[Cycle]]:
    """Register writes before the first measurement, and the measurements."""
    writes: list[tuple[int, int]] = []
    cycles: list[Cycle] = []
    pointer = None
    for transfer in transfers:
        if not transfer.is_read:
            pointer = transfer.data[0]
            if len(transfer.data) == 2 and transfer.data == b"\x00\x04":
                cycles.append(Cycle(transfer.time_ns))
            elif len(transfer.data) == 2:
                writes.append((transfer.data[0], transfer.data[1]))
            continue
        assert pointer is not None, "a read without a register written before it"
        if cycles and pointer == 0x01:
            cycles[-1].polls.append(transfer.data[0])
            if transfer.data[0] & 0x01 == 0:
                cycles[-1].t_ready_ns = transfer.time_ns
        elif pointer == 0x8F:
            assert cycles[-1].polls[-1] & 0x01 == 0, "distance read while busy"
            cycles[-1].distance_cm = transfer.data[0] * 256 + transfer.data[1]
        elif pointer == 0x0E:
            cycles[-1].strength = transfer.data[0]
        elif pointer == 0x0C:
            cycles[-1].peak = transfer.data[0]
        pointer = None
    return writes, cycles


def test_ranges_come_back_to_half_a_centimetre() -> None:
    flight = made_up_flight()
    writes, cycles = read_cycles(list(i2c_transfers(flight, LidarLiteSettings())))
    assert writes == [(0x02, 0x80), (0x04, 0x08), (0x1C, 0x00)]
    distances = np.array([cycle.distance_cm for cycle in cycles]) / 100.0
    assert np.max(np.abs(distances - flight.range_m)) <= 0.005001
    assert all(cycle.valid and cycle.strength > 24 and 135 <= cycle.peak <= 234 for cycle in cycles)


def test_command_and_end_of_busy_lie_evenly_about_the_measurement() -> None:
    flight = made_up_flight()
    _, cycles = read_cycles(list(i2c_transfers(flight, LidarLiteSettings())))
    assert [(c.t_command_ns + c.t_ready_ns) // 2 for c in cycles] == flight.range_t_ns.tolist()
    for cycle in cycles:
        assert len(cycle.polls) >= 3
        assert all(status == 0x21 for status in cycle.polls[:-1])
        assert cycle.polls[-1] == 0x20


@pytest.mark.parametrize("range_m", [0.0, 40.01])
def test_no_return_is_marked_invalid(range_m: float) -> None:
    flight = made_up_flight()
    flight.range_m[3] = range_m
    for reported_cm in (0, 1):
        settings = LidarLiteSettings(no_return_cm=reported_cm)
        _, cycles = read_cycles(list(i2c_transfers(flight, settings)))
        assert [cycle.valid for cycle in cycles] == [i != 3 for i in range(len(cycles))]
        assert (cycles[3].distance_cm, cycles[3].strength) == (reported_cm, 0)


@pytest.mark.parametrize("bus_hz", [100_000, 400_000])
def test_transfers_follow_each_other_on_the_bus(bus_hz: int) -> None:
    transfers = list(i2c_transfers(made_up_flight(), LidarLiteSettings(bus_hz=bus_hz)))
    for before, after in zip(transfers, transfers[1:]):
        assert after.time_ns - after.duration_ns > before.time_ns
    # START, three times eight bits and an acknowledge, STOP
    assert transfer_duration_ns(2, bus_hz) == 29 * 1_000_000_000 // bus_hz


def test_a_fast_device_has_shorter_cycles() -> None:
    flight = made_up_flight()
    flight.range_t_ns = flight.range_t_ns[0] + 5_000_000 * np.arange(len(flight.range_t_ns))
    _, cycles = read_cycles(list(i2c_transfers(flight, LidarLiteSettings())))
    assert [(c.t_command_ns + c.t_ready_ns) // 2 for c in cycles] == flight.range_t_ns.tolist()


def test_ranges_too_close_for_the_device_are_refused() -> None:
    flight = made_up_flight()
    flight.range_t_ns = flight.range_t_ns[0] + 3_000_000 * np.arange(len(flight.range_t_ns))
    with pytest.raises(ValueError, match="range_t_ns: ranges 3.000 ms apart"):
        list(i2c_transfers(flight, LidarLiteSettings()))


def test_a_flight_without_ranges_leaves_the_bus_alone() -> None:
    flight = made_up_flight()
    flight.range_t_ns, flight.range_m = flight.range_t_ns[:0], flight.range_m[:0]
    assert list(i2c_transfers(flight, LidarLiteSettings())) == []
