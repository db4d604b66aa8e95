"""Figures on made-up trajectories whose errors are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from plumb_tools.score import motion
from plumb_tools.score.compute import Options, Score, score
from plumb_tools.trajectory import NS_PER_S, Trajectory
from synthetic import RATE_HZ, estimate_of, flight, moved, stamps, truth_of, yaw


def figures(truth: Trajectory, est: Trajectory, options: Options | None = None) -> Score:
    return score(truth_of(truth), estimate_of(est), options or Options()).score


def resting(motion_s: float, rest_s: float) -> Trajectory:
    """A straight run at 1 m/s along x, then rest."""
    t_ns = stamps(int((motion_s + rest_s) * RATE_HZ))
    t = (t_ns - t_ns[0]) / NS_PER_S
    p = np.column_stack([np.minimum(t, motion_s), 0.2 * np.sin(np.minimum(t, motion_s)), 0.0 * t])
    return Trajectory("resting", t_ns, p, Rotation.identity(len(t)))


@pytest.mark.parametrize("selected", ["4dof", "se3", "sim3"])
def test_a_moved_copy_has_no_error_after_alignment(selected: str) -> None:
    truth = flight()
    result = figures(truth, moved(truth, yaw(70.0), (5.0, 6.0, 7.0)), Options(alignment=selected))
    for name in ("start", "4dof", "se3", "sim3"):
        errors = result.alignments[name]
        assert errors is not None
        assert errors.ate_max_m < 1e-8
        assert errors.velocity_rmse_m_s == pytest.approx(0.0, abs=1e-8)
        assert errors.tilt_max_deg < 1e-5
        assert abs(errors.heading_final_deg) < 1e-5
    assert result.scale == pytest.approx(1.0)
    assert result.path_ratio == pytest.approx(1.0)
    assert result.coverage.covered == pytest.approx(1.0)


def test_without_alignment_an_offset_is_the_error() -> None:
    truth = flight()
    result = figures(truth, moved(truth, yaw(0.0), (0.3, 0.0, -0.4)), Options(alignment="none"))
    errors = result.alignments["none"]
    assert errors is not None
    assert errors.ate_rmse_m == pytest.approx(0.5)
    assert errors.axis_max_m == pytest.approx((0.3, 0.0, 0.4))
    assert errors.axis_max_percent == pytest.approx(tuple(100.0 * e / result.distance_m for e in (0.3, 0.0, 0.4)))


def test_scale_error_shows_in_scale_and_path_ratio() -> None:
    truth = flight()
    result = figures(truth, moved(truth, yaw(10.0), (0.0, 0.0, 0.0), scale=1.04))
    assert result.scale == pytest.approx(1.0 / 1.04)
    assert result.path_ratio == pytest.approx(1.04)
    aligned = result.alignments["sim3"]
    four_dof = result.alignments["4dof"]
    assert aligned is not None
    assert four_dof is not None
    assert aligned.ate_rmse_m < 1e-8 < four_dof.ate_rmse_m


def test_early_scale_is_that_of_the_displacement_after_ten_seconds() -> None:
    truth = resting(20.0, 0.0)
    t = (truth.t_ns - truth.t_ns[0]) / NS_PER_S
    wrong = truth.p_m * np.where(t < 9.0, 1.5, 1.03)[:, None]
    est = replace(truth, p_m=wrong)
    assert figures(truth, est).early_scale == pytest.approx(1.03)
    assert figures(resting(5.0, 15.0), resting(5.0, 15.0)).early_scale is None  # at rest by then
    assert figures(resting(8.0, 0.0), resting(8.0, 0.0)).early_scale is None


def test_tilt_stays_after_4dof_and_start_alignment() -> None:
    truth = flight()
    tilt = Rotation.from_euler("x", 2.0, degrees=True)
    est = Trajectory("tilted", truth.t_ns, truth.p_m, yaw(50.0) * tilt * truth.rotation)
    result = figures(truth, est)
    for name in ("start", "4dof"):
        errors = result.alignments[name]
        assert errors is not None
        assert errors.tilt_rmse_deg == pytest.approx(2.0)


def test_heading_drift_is_counted_from_the_start() -> None:
    truth = flight()
    drift = np.linspace(0.0, np.radians(3.0), len(truth))
    turned = Rotation.from_rotvec(np.outer(drift, [0.0, 0.0, 1.0])) * truth.rotation
    result = figures(truth, Trajectory("drifting", truth.t_ns, truth.p_m, yaw(-20.0) * turned))
    errors = result.alignments["start"]
    assert errors is not None
    assert errors.heading_final_deg == pytest.approx(3.0)
    assert errors.heading_rmse_deg == pytest.approx(np.degrees(np.sqrt(np.mean(drift**2))))
    assert errors.tilt_max_deg == pytest.approx(0.0, abs=1e-5)


def test_velocity_error_is_measured_in_the_truth_frame() -> None:
    truth = flight()
    est = moved(truth, yaw(80.0), (1.0, 1.0, 1.0))
    assert est.v_m_s is not None
    result = figures(truth, replace(est, v_m_s=est.v_m_s + np.array([0.03, 0.0, 0.04])))
    errors = result.alignments["start"]
    assert errors is not None
    assert errors.velocity_rmse_m_s == pytest.approx(0.05)


def test_velocity_of_a_truth_without_it_is_differentiated() -> None:
    dense = flight()
    result = figures(replace(dense, v_m_s=None), dense)
    errors = result.alignments["start"]
    assert errors is not None
    assert errors.velocity_rmse_m_s == pytest.approx(0.0, abs=5e-3)


def test_truth_is_interpolated_to_the_stamps_of_the_estimate() -> None:
    t_ns = stamps(100)
    t = (t_ns - t_ns[0]) / NS_PER_S
    line = np.column_stack([t, 0.5 * t, np.sin(0.0 * t)])
    truth = Trajectory("line", t_ns, line, Rotation.identity(100))
    shift_ns = 7_000_000
    shifted = line[:-1] + np.array([1.0, 0.5, 0.0]) * shift_ns / NS_PER_S
    est = Trajectory("shifted", t_ns[:-1] + shift_ns, shifted, Rotation.identity(99))
    errors = figures(truth, est, Options(alignment="none")).alignments["none"]
    assert errors is not None
    assert errors.ate_max_m < 1e-9


def test_segments_of_a_scaled_path_have_the_scale_error() -> None:
    truth = flight()
    est = moved(truth, yaw(10.0), (0.0, 0.0, 0.0), scale=1.02)
    result = figures(truth, est)
    assert [segment.length_m for segment in result.segments] == [2.0, 5.0, 10.0, 20.0]
    # The displacement over a curved segment is shorter than the segment itself.
    assert 1.0 < result.segments[0].translation_percent < 2.0
    assert all(segment.rotation_rmse_deg < 1e-5 for segment in result.segments)


def test_noise_at_rest_is_not_distance_travelled() -> None:
    random = np.random.default_rng(7)
    truth = resting(motion_s=5.0, rest_s=20.0)
    noisy = replace(truth, p_m=truth.p_m + random.normal(scale=5e-4, size=truth.p_m.shape))
    assert figures(noisy, truth).distance_m == pytest.approx(figures(truth, truth).distance_m, rel=0.01)


def test_drift_in_the_final_standstill() -> None:
    truth = resting(motion_s=5.0, rest_s=10.0)
    t = (truth.t_ns - truth.t_ns[0]) / NS_PER_S
    creep = np.outer(np.maximum(t - 5.0, 0.0), [0.0, 0.01, 0.0])
    still = figures(truth, replace(truth, p_m=truth.p_m + creep)).standstill
    assert still is not None
    assert still.duration_s == pytest.approx(10.0, abs=0.3)
    assert still.drift_m == pytest.approx(0.01 * 9.0, rel=0.03)
    assert still.truth_drift_m == pytest.approx(0.0, abs=1e-12)


def test_no_standstill_while_moving() -> None:
    assert figures(flight(), flight()).standstill is None


def test_coverage_leaves_out_what_is_before_the_first_output_and_long_gaps() -> None:
    t = np.arange(0.0, 20.001, 0.05)
    kept = t[(t >= 2.0) & ((t <= 8.0) | (t >= 11.0))]
    found = motion.coverage(kept, 0.0, 20.0)
    assert found.covered == pytest.approx((20.0 - 2.0 - 3.0) / 20.0)
    assert found.first_output_s == pytest.approx(2.0)
    assert found.longest_gap_s == pytest.approx(3.0)


def test_coverage_of_a_slow_but_steady_estimate_is_whole() -> None:
    assert motion.coverage(np.arange(0.0, 21.0), 0.0, 20.0).covered == pytest.approx(1.0)


def test_window_selects_seconds_after_the_start_of_the_span() -> None:
    truth = flight()
    t = (truth.t_ns - truth.t_ns[0]) / NS_PER_S
    jump = np.where(t > 12.0, 5.0, 0.0)[:, None] * np.array([1.0, 0.0, 0.0])
    est = replace(truth, p_m=truth.p_m + jump)
    result = figures(truth, est, Options(start_s=2.0, end_s=12.0))
    errors = result.alignments["4dof"]
    assert errors is not None
    assert errors.ate_max_m < 1e-9
    assert result.pairs == 201
    assert result.coverage.span_s == pytest.approx(10.0)
