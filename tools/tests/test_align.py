"""Alignment: known transforms are recovered, and the closed form is the optimum."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from plumb_tools.score import align
from synthetic import flight, moved, yaw

SEED = 20260101


def test_four_dof_equals_the_numeric_optimum_on_noisy_poses() -> None:
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    truth = flight()
    for yaw_deg in (0.0, 57.0, -120.0, 179.5):
        est = moved(truth, yaw(yaw_deg), (3.0, -2.0, 1.0), scale=1.05)
        est_p = est.p_m + random.normal(scale=0.2, size=est.p_m.shape)

        def cost(x: np.ndarray, est_p: np.ndarray = est_p) -> float:
            return float(np.sum(np.square(truth.p_m - align.yaw_rotation(x[0]).apply(est_p) - x[1:])))

        found = align.four_dof(truth.p_m, truth.rotation, est_p, est.rotation)
        found_yaw = float(align.twist_about_z(found.rotation)[0])
        start = np.array([found_yaw + 0.3, *(found.translation_m + 0.5)])
        optimum = minimize(cost, start, method="BFGS", options={"gtol": 1e-7})
        assert math.remainder(optimum.x[0] - found_yaw, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-5)
        assert optimum.x[1:] == pytest.approx(found.translation_m, abs=1e-4)
        assert cost(np.array([found_yaw, *found.translation_m])) <= optimum.fun * (1.0 + 1e-9)


@pytest.mark.parametrize("yaw_deg", [0.0, 1.0, 90.0, 180.0, -135.0])
def test_four_dof_recovers_yaw_and_translation(yaw_deg: float) -> None:
    truth = flight()
    est = moved(truth, yaw(yaw_deg).inv(), (10.0, -4.0, 2.0))
    found = align.four_dof(truth.p_m, truth.rotation, est.p_m, est.rotation)
    assert (found.rotation * yaw(yaw_deg).inv()).magnitude() == pytest.approx(0.0, abs=1e-9)
    assert found.positions(est.p_m) == pytest.approx(truth.p_m, abs=1e-9)


def test_four_dof_does_not_hide_tilt() -> None:
    truth = flight()
    est = moved(truth, Rotation.from_euler("x", 5.0, degrees=True), (0.0, 0.0, 0.0))
    found = align.four_dof(truth.p_m, truth.rotation, est.p_m, est.rotation)
    assert found.rotation.apply([0.0, 0.0, 1.0]) == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)


def test_four_dof_takes_yaw_from_attitudes_when_the_path_is_vertical() -> None:
    truth = flight()
    vertical = truth.p_m * np.array([0.0, 0.0, 1.0])
    found = align.four_dof(vertical, truth.rotation, vertical, yaw(40.0).inv() * truth.rotation)
    assert np.degrees(align.twist_about_z(found.rotation)[0]) == pytest.approx(40.0, abs=1e-9)


def test_start_alignment_meets_the_first_pose_but_for_tilt() -> None:
    truth = flight()
    est = moved(truth, yaw(33.0), (1.0, 2.0, 3.0))
    found = align.at_pose(truth.p_m[0], truth.rotation[0], est.p_m[0], est.rotation[0])
    assert found.positions(est.p_m) == pytest.approx(truth.p_m, abs=1e-9)


@pytest.mark.parametrize("scale", [0.5, 0.97, 1.0, 1.3])
def test_sim3_recovers_scale_rotation_and_translation(scale: float) -> None:
    truth = flight()
    est = moved(truth, Rotation.from_rotvec([0.3, -0.2, 1.0]), (1.0, 2.0, 3.0), 1.0 / scale)
    found = align.umeyama(truth.p_m, est.p_m, with_scale=True)
    assert found is not None
    assert found.scale == pytest.approx(scale, rel=1e-9)
    assert found.positions(est.p_m) == pytest.approx(truth.p_m, abs=1e-8)


def test_umeyama_without_motion_is_undetermined() -> None:
    still = np.zeros((50, 3))
    assert align.umeyama(still, still, with_scale=False) is None
    assert align.umeyama(still, still, with_scale=True) is None


def test_twist_has_no_singularity_with_the_body_axis_vertical() -> None:
    up = Rotation.from_euler("y", -90.0, degrees=True)
    turned = yaw(25.0) * up
    assert np.degrees(align.twist_about_z(turned * up.inv())[0]) == pytest.approx(25.0)
