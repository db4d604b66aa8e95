"""The range finder's beam, errors and limits; the camera's automatic exposure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from sim_scenes import plan

from plumb_tools.sim import clock, exposure, lrf
from plumb_tools.sim.flight import RangeData, RangeStatus
from plumb_tools.sim.motion import Trajectory
from plumb_tools.sim.rig import rig
from plumb_tools.sim.sensors import Camera, RangeFinder

SAMPLES = 4000


def _sampled(sensor: RangeFinder, true_m: float, outlier_share: float = 0.0) -> RangeData:
    instants = clock.instants("lrf", sensor.clock, sensor.rate_hz, SAMPLES / sensor.rate_hz, 0)
    count = len(instants.t_s)
    return lrf.sample(
        sensor, np.full(count, true_m), instants, np.full(count, outlier_share), np.zeros(count, bool), seed=0
    )


def test_noise_and_quantisation_are_those_told_to_the_filter() -> None:
    sensor = RangeFinder()
    data = _sampled(sensor, 11.0)
    valid = data.range_m[data.status == RangeStatus.VALID]
    assert valid.mean() == pytest.approx(11.0, abs=0.002)
    assert valid.std() == pytest.approx(lrf.effective_noise_m(sensor), rel=0.05)
    assert np.abs(valid / 0.01 - np.round(valid / 0.01)).max() < 1e-6
    assert np.mean(data.status == RangeStatus.NO_RETURN) == pytest.approx(sensor.dropout, abs=0.003)


def test_an_ideal_range_finder_tells_the_truth() -> None:
    data = _sampled(RangeFinder(ideal=True), 11.123456)
    assert np.all(data.range_m == 11.123456)


@pytest.mark.parametrize(
    ("true_m", "status"),
    [(0.01, RangeStatus.OUT_OF_LIMITS), (41.0, RangeStatus.OUT_OF_LIMITS), (np.inf, RangeStatus.NO_RETURN)],
)
def test_nothing_is_told_beyond_the_limits(true_m: float, status: RangeStatus) -> None:
    data = _sampled(RangeFinder(noise_m=0.0, dropout=0.0), true_m)
    assert np.all(data.status == status)
    assert np.all(data.range_m == 0.0)


def test_outliers_are_too_short() -> None:
    data = _sampled(RangeFinder(dropout=0.0), 11.0, outlier_share=0.2)
    assert np.mean((data.status == RangeStatus.VALID) & (data.range_m < 10.5)) == pytest.approx(0.19, abs=0.02)


def test_a_wide_beam_sees_both_sides_of_an_edge(tmp_path: Path) -> None:
    """Over the edge of a box: `first` tells the box until a fifth of the beam is left on it, `mean` lies between."""
    box = [{"kind": "box", "center_m": [0, 0], "size_m": [2, 2, 1], "material": "concrete"}]
    of = plan(tmp_path, {"scene.objects": box, "sensors.lrf.divergence_rad": 0.05})
    on_board = rig(of.scene.sensors.camera, of.scene.sensors.lrf)
    motion = Trajectory.of(of.scene, 0).at(np.arange(0.0, 1.2, 0.01))

    def ranges(returns: str) -> np.ndarray:
        sensor = RangeFinder(divergence_rad=0.05, returns=returns)
        return lrf.true_ranges(sensor, on_board, of.caster, motion)

    first, mean = ranges("first"), ranges("mean")
    between = (mean > 3.1) & (mean < 3.9)
    assert between.sum() >= 3
    assert np.all(first[between] < 3.1)


def test_exposure_follows_the_light_within_its_limits() -> None:
    camera = Camera()
    bright, dim = np.full(200, 0.4), np.full(200, 0.02)
    day = exposure.settings(camera, 1.0, np.concatenate([bright, dim]))
    product = day.exposure_s * day.gain
    assert product[199] * 0.4 == pytest.approx(product[399] * 0.02, rel=0.01)
    assert np.all(np.diff(product[200:]) >= 0.0)  # without a jump
    assert product[203] < 0.5 * product[399]
    dusk = exposure.settings(camera, 0.001, bright)
    assert np.all(dusk.exposure_s == camera.exposure.time_s[1])
    assert np.all(dusk.gain == camera.exposure.gain_max)
