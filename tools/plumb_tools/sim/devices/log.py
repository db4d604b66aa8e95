"""A simulated flight as an LCM event log of raw device bytes, with the truth on a channel of its own.

| channel        | type            | stamp of the event                                   |
|----------------|-----------------|------------------------------------------------------|
| CALIBRATION    | calibration_t   | that of the first event, before which it stands      |
| RAW_STIM300    | raw_bytes_t     | arrival of the last byte                             |
| RAW_LIDAR_LITE | i2c_transfer_t  | STOP of the transfer                                 |
| RAW_CAN        | can_frame_t     | end of the frame                                     |
| RAW_CAMERA     | camera_buffer_t | end of the frame                                     |
| CAMERA         | image_t         | end of the frame, right behind its RAW_CAMERA        |
| TRUTH          | truth_t         | its own                                              |

Events stand in the order of their stamps. LCM keeps those in microseconds; the messages carry them in nanoseconds.
"""

from __future__ import annotations

import heapq
import itertools
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

import lcm
import numpy as np

from plumb_tools.sim.devices import messages
from plumb_tools.sim.devices.camera import CameraSettings, camera_buffers
from plumb_tools.sim.devices.can_range import CanRangeSettings, can_frames
from plumb_tools.sim.devices.flight_protocol import Flight, TrueBiases, check_flight
from plumb_tools.sim.devices.lidar_lite import LidarLiteSettings, i2c_transfers
from plumb_tools.sim.devices.stim300 import Stim300Settings
from plumb_tools.sim.devices.stim300_stream import serial_chunks

RangeFinder = Literal["lidar_lite", "can"]

_EVENT_HEADER_BYTES = 4 + 8 + 8 + 4 + 4
_PROGRESS_STEPS = 200

#: Of a STIM300 with filters at 262 Hz, delayed gyros and increments at 250 Hz, which its driver takes off a stamp:
#: filter, delay of the gyros, and from the middle of 8 internal samples, 0.5 ms apart, to the last.
_GROUP_DELAY_NS = 2_200_000 + 4_000_000 + 1_750_000


@dataclass(frozen=True)
class DeviceSettings:
    """How the devices are set up; by default as on the reference vehicle, so that plumb-fsw flies by what they say."""

    stim300: Stim300Settings = field(
        default_factory=lambda: Stim300Settings(incremental=True, group_delay_ns=_GROUP_DELAY_NS)
    )
    lidar_lite: LidarLiteSettings = field(default_factory=LidarLiteSettings)
    can_range: CanRangeSettings = field(default_factory=CanRangeSettings)
    camera: CameraSettings = field(default_factory=CameraSettings)


@dataclass(frozen=True)
class _Event:
    time_ns: int
    channel: str
    message: bytes


def _serial_events(flight: Flight, settings: DeviceSettings) -> Iterator[_Event]:
    for chunk in serial_chunks(flight, settings.stim300):
        yield _Event(chunk.time_ns, "RAW_STIM300", messages.serial_chunk(chunk))


def _range_events(flight: Flight, settings: DeviceSettings, lrf: RangeFinder) -> Iterator[_Event]:
    if lrf == "can":
        for frame in can_frames(flight, settings.can_range):
            yield _Event(frame.time_ns, "RAW_CAN", messages.can_frame(frame))
    else:
        for transfer in i2c_transfers(flight, settings.lidar_lite):
            yield _Event(transfer.time_ns, "RAW_LIDAR_LITE", messages.i2c_transfer(transfer))


def _camera_events(flight: Flight, settings: DeviceSettings) -> Iterator[_Event]:
    for buffer in camera_buffers(flight, settings.camera):
        yield _Event(buffer.arrival_ns, "RAW_CAMERA", messages.camera_buffer(buffer))
        yield _Event(buffer.arrival_ns, "CAMERA", messages.image(buffer))


def _truth_events(flight: Flight) -> Iterator[_Event]:
    biases = np.full((len(flight.truth_t_ns), 6), np.nan)
    if isinstance(flight, TrueBiases):
        biases = np.hstack([flight.truth_b_gyro_rad_s, flight.truth_b_accel_m_s2])
    rows = zip(
        flight.truth_t_ns.tolist(), flight.truth_p_m, flight.truth_v_m_s, flight.truth_q_wxyz, biases, strict=True
    )
    for t_ns, p_m, v_m_s, q_wxyz, bias in rows:
        yield _Event(t_ns, "TRUTH", messages.truth(t_ns, p_m, v_m_s, q_wxyz, bias))


def _events(flight: Flight, settings: DeviceSettings, lrf: RangeFinder) -> Iterator[_Event]:
    """All events in the order of their stamps; those of the same stamp in the order of the sources here."""
    sources = (
        _truth_events(flight),
        _serial_events(flight, settings),
        _range_events(flight, settings, lrf),
        _camera_events(flight, settings),
    )
    merged = heapq.merge(*sources, key=lambda event: event.time_ns)
    first = next(merged)
    if first.time_ns < 0:
        raise ValueError(
            f"{first.channel}: the device would have to start {-first.time_ns / 1e6:.3f} ms before the zero of the "
            "clock; let the flight begin later"
        )
    yield _Event(first.time_ns, "CALIBRATION", messages.calibration(flight.calibration))
    yield from itertools.chain([first], merged)


def _write_events(
    events: Iterator[_Event], path: Path, span_ns: tuple[int, int], progress: Callable[[float], None] | None
) -> Counter[str]:
    """Writes a whole log; OSError when less than that is in the file afterwards."""
    counts: Counter[str] = Counter()
    size = 0
    steps_done = 0
    start_ns, end_ns = span_ns
    log = lcm.EventLog(path, mode="w", overwrite=True)
    try:
        for event in events:
            log.write_event(event.time_ns // 1000, event.channel, event.message)
            counts[event.channel] += 1
            size += _EVENT_HEADER_BYTES + len(event.channel) + len(event.message)
            steps = int(_PROGRESS_STEPS * (event.time_ns - start_ns) / max(1, end_ns - start_ns))
            if progress is not None and steps_done < steps < _PROGRESS_STEPS:
                steps_done = steps
                progress(steps / _PROGRESS_STEPS)
    finally:
        log.close()
    if path.stat().st_size != size:
        raise OSError(f"{path}: {path.stat().st_size} of {size} bytes written; is the disk full?")
    if progress is not None:
        progress(1.0)
    return counts


def write_log(
    flight: Flight,
    path: Path,
    lrf: RangeFinder = "lidar_lite",
    *,
    settings: DeviceSettings | None = None,
    progress: Callable[[float], None] | None = None,
) -> Counter[str]:
    """Writes the flight to an LCM event log and returns the number of events of each channel.

    The log appears under its name only when it is whole; until then it is `<name>.partial`, which a failure removes.
    Images are read one by one. `progress` is told the fraction done, from 0 to 1.
    """
    check_flight(flight)
    if lrf not in get_args(RangeFinder):
        raise ValueError(f"lrf: '{lrf}'; expected {' or '.join(get_args(RangeFinder))}")
    partial = path.with_name(path.name + ".partial")
    span_ns = (int(flight.imu_t_ns[0]), int(flight.imu_t_ns[-1]))
    try:
        counts = _write_events(_events(flight, settings or DeviceSettings(), lrf), partial, span_ns, progress)
        partial.replace(path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise
    return counts
