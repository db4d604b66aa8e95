"""A flight's images as Video4Linux buffers of an OV7251 global-shutter camera.

Facts: Linux drivers/media/i2c/ov7251.c (exposure in rows, gain 16 = 1x, a row of 928 pixels at 48 MHz, 504 rows as
default), include/uapi/linux/videodev2.h (flags of the stamp, fourcc), camss (stamp at the end of the frame, the
sequence counts the frames delivered).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from plumb_tools.sim.devices.flight_protocol import Flight, ImageExposures

PIXEL_FORMAT_GREY = int.from_bytes(b"GREY", "little")

FLAG_TIMESTAMP_MONOTONIC = 0x2000
FLAG_TSTAMP_SRC_EOF = 0x00000
FLAG_TSTAMP_SRC_SOE = 0x10000

_UNIT_GAIN = 16
_MAX_GAIN = 1023


@dataclass(frozen=True)
class Exposure:
    """The controls of the sensor for one image."""

    lines: int = 504  #: V4L2_CID_EXPOSURE [rows]
    gain: int = 16  #: V4L2_CID_GAIN, 16 is 1x


@dataclass(frozen=True)
class CameraSettings:
    """Timing of sensor and bridge."""

    line_pixels: int = 928  #: of a row with its blanking
    pixel_rate_hz: int = 48_000_000
    stamp_is_start_of_exposure: bool = False  #: else the end of the frame

    def lines_ns(self, lines: int) -> int:
        """Time that so many rows take."""
        return round(lines * self.line_pixels * 1e9 / self.pixel_rate_hz)


@dataclass(frozen=True)
class CameraBuffer:
    """A filled buffer and what Video4Linux says of it."""

    arrival_ns: int  #: end of the frame
    stamp_ns: int
    flags: int
    sequence: int
    exposure: Exposure
    line_time_ns: int
    readout_ns: int
    mid_exposure_ns: int
    pixels: npt.NDArray[np.uint8]  #: (height, width)


def read_grey(path: Path, width: int, height: int) -> npt.NDArray[np.uint8]:
    """An 8-bit grey image of the given size; ValueError for any other."""
    with Image.open(path) as image:
        if image.mode != "L" or image.size != (width, height):
            found = f"{image.size[0]} x {image.size[1]} px, mode {image.mode}"
            raise ValueError(f"{path}: expected 8-bit grey (mode L), {width} x {height} px; found {found}")
        return np.asarray(image)


def exposures(flight: Flight, settings: CameraSettings) -> list[Exposure]:
    """One per image, to the steps of the sensor's controls."""
    if not isinstance(flight, ImageExposures):
        return [Exposure()] * len(flight.images)
    line_s = settings.line_pixels / settings.pixel_rate_hz
    return [
        Exposure(max(1, round(exposure_s / line_s)), min(max(round(gain * _UNIT_GAIN), _UNIT_GAIN), _MAX_GAIN))
        for exposure_s, gain in zip(flight.image_exposure_s.tolist(), flight.image_gain.tolist(), strict=True)
    ]


def camera_buffers(flight: Flight, settings: CameraSettings) -> Iterator[CameraBuffer]:
    """Every image of the flight, read when its turn comes."""
    width, height = flight.calibration.width, flight.calibration.height
    readout_ns = settings.lines_ns(height)
    images = zip(flight.images, exposures(flight, settings), strict=True)
    for sequence, ((mid_exposure_ns, path), exposure) in enumerate(images):
        half_exposure_ns = settings.lines_ns(exposure.lines) // 2
        end_of_frame_ns = mid_exposure_ns + half_exposure_ns + readout_ns
        start_stamped = settings.stamp_is_start_of_exposure
        yield CameraBuffer(
            arrival_ns=end_of_frame_ns,
            stamp_ns=mid_exposure_ns - half_exposure_ns if start_stamped else end_of_frame_ns,
            flags=FLAG_TIMESTAMP_MONOTONIC | (FLAG_TSTAMP_SRC_SOE if start_stamped else FLAG_TSTAMP_SRC_EOF),
            sequence=sequence,
            exposure=exposure,
            line_time_ns=settings.lines_ns(1),
            readout_ns=readout_ns,
            mid_exposure_ns=mid_exposure_ns,
            pixels=read_grey(path, width, height),
        )
