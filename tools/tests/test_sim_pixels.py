"""From light to numbers, and from instants to stamps: noise, vignetting, motion blur, clocks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from plumb_tools.sim import clock
from plumb_tools.sim.camera import Optics, Sensor
from plumb_tools.sim.flight import EPOCH_NS
from plumb_tools.sim.frames import FrameMaker
from plumb_tools.sim.sensors import Camera, Clock, Lens, Pixel
from sim_scenes import plan

FAST = {"trajectory.start.velocity_m_s": [8, 0, 0], "trajectory.segments": [{"do": "hold", "duration_s": 0.6}]}


def _of_grey(camera: Camera, gain: float) -> np.ndarray:
    """An image of an even grey that gives half of full scale."""
    pixel = camera.pixel
    exposure_s = 0.5 * pixel.full_well_e / pixel.electrons_per_s / gain
    radiance = np.ones((camera.height_px, camera.width_px), np.float32)
    return Sensor(camera, 1.0, seed=3).image(radiance, exposure_s, gain, frame=0).astype(float)


@pytest.mark.parametrize("gain", [1.0, 8.0])
def test_noise_is_that_of_photons_and_of_reading(gain: float) -> None:
    camera = Camera(pixel=Pixel(pattern_noise=0.0, read_noise_e=20.0))
    image = _of_grey(camera, gain)
    electrons = 0.5 * camera.pixel.full_well_e / gain
    per_electron = 255.0 * gain / camera.pixel.full_well_e
    sigma = per_electron * np.sqrt(electrons + camera.pixel.read_noise_e**2)
    assert image.mean() == pytest.approx(127.5, abs=0.1)
    assert image.std() == pytest.approx(np.hypot(sigma, 12.0**-0.5), rel=0.02)


def test_an_ideal_camera_has_no_noise() -> None:
    assert np.ptp(_of_grey(Camera(ideal=True), 4.0)) == 0.0


def test_the_corners_are_darker_by_the_vignetting() -> None:
    fall_off = Optics(Camera(lens=Lens(vignetting=0.35))).vignetting
    assert fall_off.max() == pytest.approx(1.0, abs=1e-4)
    assert fall_off.min() == pytest.approx(0.65, abs=1e-4)
    assert np.unravel_index(fall_off.argmax(), fall_off.shape) == pytest.approx((238, 321), abs=1)


def test_motion_blurs_along_the_motion_alone(tmp_path: Path) -> None:
    of = plan(tmp_path, FAST | {"sensors.camera.blur_frames": 8, "sensors.camera.misalignment_deg": [0, 0, 0]})
    maker = FrameMaker(of.scene, of.world, of.seed)

    def sharpness(exposure_s: float) -> tuple[float, float]:
        """Mean change from pixel to pixel along the motion, which is up in the image, and across it."""
        positions, rotations = maker.poses(np.array([0.3]), np.array([exposure_s]))
        image = maker.radiance(positions[0], rotations[0])
        return float(np.abs(np.diff(image, axis=0)).mean()), float(np.abs(np.diff(image, axis=1)).mean())

    still, blurred = sharpness(0.0), sharpness(0.03)  # 6 px
    assert blurred[0] < 0.6 * still[0]
    assert blurred[0] / blurred[1] < 0.75 * still[0] / still[1]


def test_stamps_have_the_offset_and_the_jitter_of_the_clock() -> None:
    told = clock.instants("imu", Clock(phase=0.25, offset_s=0.003, jitter_s=1e-4), 250.0, 40.0, seed=5)
    assert np.allclose(told.t_s, (np.arange(len(told.t_s)) + 0.25) / 250.0, atol=1e-9)
    error_s = 1e-9 * (told.stamp_ns - EPOCH_NS) - told.t_s
    assert error_s.mean() == pytest.approx(0.003, abs=5e-6)
    assert error_s.std() == pytest.approx(1e-4, rel=0.03)


def test_stamps_rise_however_large_the_jitter() -> None:
    told = clock.instants("camera", Clock(jitter_s=0.01), 250.0, 20.0, seed=5)
    assert np.diff(told.stamp_ns).min() > 0
