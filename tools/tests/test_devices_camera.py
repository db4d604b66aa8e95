"""Camera buffers: the mid-exposure time a driver computes, and what the calibration record says of the lens."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from devices_flight import HEIGHT, WIDTH, CompleteFlight, MadeUpCalibration, MadeUpFlight, made_up_flight, write_images
from plumb_tools.sim.devices.camera import CameraSettings, camera_buffers
from plumb_tools.sim.devices.field_of_view import half_field_of_view, project, unproject

LINE_NS = 928 / 48e6 * 1e9


def flight_with_images(folder: Path) -> MadeUpFlight:
    flight = made_up_flight(seconds=0.5)
    flight.images = write_images(folder, 0.5)
    return flight


@pytest.mark.parametrize("from_start", [False, True])
def test_mid_exposure_follows_from_stamp_and_exposure(tmp_path: Path, from_start: bool) -> None:
    plain = flight_with_images(tmp_path)
    count = len(plain.images)
    flight = CompleteFlight(
        **vars(plain),
        truth_b_gyro_rad_s=np.zeros((len(plain.truth_t_ns), 3)),
        truth_b_accel_m_s2=np.zeros((len(plain.truth_t_ns), 3)),
        image_exposure_s=np.linspace(1e-3, 12e-3, count),
        image_gain=np.linspace(1.0, 70.0, count),
    )
    buffers = list(camera_buffers(flight, CameraSettings(stamp_is_start_of_exposure=from_start)))
    for i, (buffer, (mid_ns, _)) in enumerate(zip(buffers, flight.images, strict=True)):
        exposure_ns = buffer.exposure.lines * LINE_NS
        assert exposure_ns == pytest.approx(flight.image_exposure_s[i] * 1e9, abs=LINE_NS / 2 + 1)
        if from_start:
            computed_ns = buffer.stamp_ns + exposure_ns / 2
        else:
            computed_ns = buffer.stamp_ns - HEIGHT * LINE_NS - exposure_ns / 2
        assert computed_ns == pytest.approx(mid_ns, abs=2.0)
        assert buffer.flags == (0x12000 if from_start else 0x2000)
        assert buffer.arrival_ns >= buffer.stamp_ns
    assert [buffer.sequence for buffer in buffers] == list(range(count))
    assert buffers[0].exposure.gain == 16
    assert buffers[-1].exposure.gain == 1023  # the sensor has no more


def test_without_exposures_the_sensor_has_its_default(tmp_path: Path) -> None:
    buffer = next(camera_buffers(flight_with_images(tmp_path), CameraSettings()))
    assert (buffer.exposure.lines, buffer.exposure.gain) == (504, 16)
    assert buffer.line_time_ns == 19333
    assert buffer.arrival_ns - buffer.mid_exposure_ns == 4_872_000 + 928_000


def test_images_are_read_one_by_one(tmp_path: Path) -> None:
    flight = flight_with_images(tmp_path)
    buffers = camera_buffers(flight, CameraSettings())
    first = next(buffers)
    assert np.array_equal(first.pixels, np.asarray(Image.open(flight.images[0][1])))
    flight.images[1][1].unlink()
    with pytest.raises(FileNotFoundError):
        next(buffers)


def test_an_image_of_another_kind_is_refused(tmp_path: Path) -> None:
    flight = flight_with_images(tmp_path)
    Image.new("RGB", (WIDTH, HEIGHT)).save(flight.images[0][1])
    with pytest.raises(ValueError, match=r"expected 8-bit grey \(mode L\), 64 x 48 px; found 64 x 48 px, mode RGB"):
        next(camera_buffers(flight, CameraSettings()))
    Image.new("L", (WIDTH, HEIGHT + 1)).save(flight.images[0][1])
    with pytest.raises(ValueError, match="found 64 x 49 px"):
        next(camera_buffers(flight, CameraSettings()))


def test_half_field_of_view_of_lenses_with_a_closed_form() -> None:
    x = (WIDTH - 1 - 31.0) / 40.0
    left = 31.0 / 40.0
    y = 24.5 / 41.0
    none = MadeUpCalibration(distortion_model="none", distortion_coefficients=())
    assert half_field_of_view(none) == pytest.approx((max(x, left), y), rel=1e-12)
    equidistant = MadeUpCalibration(distortion_model="equidistant", distortion_coefficients=(0.0,) * 4)
    assert half_field_of_view(equidistant) == pytest.approx((math.tan(max(x, left)), math.tan(y)), rel=1e-9)
    w = 0.9
    fov = MadeUpCalibration(distortion_model="fov", distortion_coefficients=(w,))
    expected = [math.tan(r * w) / (2.0 * math.tan(w / 2.0)) for r in (max(x, left), y)]
    assert half_field_of_view(fov) == pytest.approx(expected, rel=1e-9)


def test_radial_tangential_lens_as_in_the_textbook() -> None:
    lens = MadeUpCalibration(distortion_coefficients=(-0.28, 0.07, 2e-3, -1e-3))
    x, y = 0.3, -0.4
    r2 = x * x + y * y
    radial = 1.0 - 0.28 * r2 + 0.07 * r2 * r2
    u = 40.0 * (x * radial + 2.0 * 2e-3 * x * y - 1e-3 * (r2 + 2.0 * x * x)) + 31.0
    v = 41.0 * (y * radial + 2e-3 * (r2 + 2.0 * y * y) - 2.0 * 1e-3 * x * y) + 24.5
    assert project(lens, np.array([x, y])) == pytest.approx([u, v], rel=1e-12)
    assert unproject(lens, np.array([u, v])) == pytest.approx([x, y], abs=1e-9)


def test_a_lens_that_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="distortion_model: 'fisheye'; expected none, radial-tangential"):
        half_field_of_view(MadeUpCalibration(distortion_model="fisheye"))
    with pytest.raises(ValueError, match="4 numbers; fov has 1"):
        half_field_of_view(MadeUpCalibration(distortion_model="fov"))
    folding = MadeUpCalibration(distortion_coefficients=(-3.0, 0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="the lens model images nothing at pixel"):
        half_field_of_view(folding)
