"""NEES: samples of a known covariance, and the frame in which errors are counted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from plumb_tools.score.compute import Options, score
from plumb_tools.score.consistency import chi2_mean_bounds, filter_errors, nees, nees_values
from plumb_tools.score.estimate import Covariances, Estimate
from plumb_tools.score.pairs import associate
from plumb_tools.trajectory import Trajectory
from synthetic import estimate_of, flight, moved, truth_of, yaw

SEED = 20260102
COUNT = 4000
RUN = 1500


def random_covariance(random: np.random.Generator, scale: float) -> np.ndarray:
    """A full covariance matrix (3, 3) with standard deviations around a scale."""
    root = scale * (np.eye(3) + 0.4 * random.normal(size=(3, 3)))
    return root @ root.T


def constant(blocks: list[np.ndarray], count: int) -> Covariances:
    """The same three blocks at every pose."""
    return Covariances(*(np.broadcast_to(block, (count, 3, 3)).copy() for block in blocks))


def test_nees_of_drawn_errors_is_within_its_bounds() -> None:
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    covariances = np.array([random_covariance(random, 0.1) for _ in range(COUNT)])
    errors = np.array([random.multivariate_normal(np.zeros(3), p) for p in covariances])
    found = nees(errors, covariances)
    assert found is not None
    assert found.lower < found.mean < found.upper
    assert found.inside == pytest.approx(0.95, abs=0.015)
    assert found.median == pytest.approx(2.366, abs=0.12)
    assert (found.samples, found.skipped) == (COUNT, 0)


@pytest.mark.parametrize(("factor", "overconfident"), [(0.25, True), (4.0, False)])
def test_nees_of_a_wrong_covariance_leaves_its_bounds(factor: float, overconfident: bool) -> None:
    random = np.random.default_rng(SEED)
    errors = random.normal(size=(COUNT, 3))
    found = nees(errors, np.broadcast_to(factor * np.eye(3), (COUNT, 3, 3)))
    assert found is not None
    assert (found.mean > found.upper) if overconfident else (found.mean < found.lower)


def test_bounds_of_one_sample_are_those_of_chi_square() -> None:
    assert chi2_mean_bounds(1) == pytest.approx((0.2158, 9.3484), abs=1e-4)
    lower, upper = chi2_mean_bounds(1000)
    assert 2.8 < lower < 3.0 < upper < 3.2


def test_singular_covariances_are_skipped_not_inverted() -> None:
    covariances = np.array([np.eye(3), np.zeros((3, 3)), np.diag([1.0, 1.0, 0.0]), np.diag([1.0, 1.0, -1.0])])
    values = nees_values(np.ones((4, 3)), covariances)
    assert values[0] == pytest.approx(3.0)
    assert np.isnan(values[1:]).all()
    assert nees(np.ones((1, 3)), np.zeros((1, 3, 3))) is None


def drawn_estimate(random: np.random.Generator) -> tuple[Trajectory, Estimate]:
    """A truth, and an estimate in its own world frame with errors of a known covariance; exact at its first pose."""
    truth = flight(RUN)
    blocks = [random_covariance(random, scale) for scale in (0.1, 0.05, 0.01)]
    draws = [random.multivariate_normal(np.zeros(3), block, size=RUN) for block in blocks]
    for draw in draws:
        draw[0] = 0.0
    in_w = moved(truth, yaw(-75.0), (4.0, -3.0, 1.0))
    assert in_w.v_m_s is not None
    est = Trajectory(
        "drawn",
        in_w.t_ns,
        in_w.p_m + draws[0],
        in_w.rotation * Rotation.from_rotvec(draws[2]).inv(),  # R = R_hat Exp(dtheta)
        in_w.v_m_s + draws[1],
    )
    return truth, estimate_of(est, constant(blocks, RUN))


def test_nees_of_a_whole_run_is_within_its_bounds_in_every_part() -> None:
    print(f"seed {SEED}")
    truth, est = drawn_estimate(np.random.default_rng(SEED))
    found = score(truth_of(truth), est, Options()).score.consistency
    assert found is not None
    for part in (found.position, found.velocity, found.attitude):
        assert part is not None
        assert part.samples == RUN - 1
        assert part.lower < part.mean < part.upper


def test_nees_of_a_window_still_counts_from_the_first_pose() -> None:
    truth, est = drawn_estimate(np.random.default_rng(SEED))
    found = score(truth_of(truth), est, Options(start_s=20.0, end_s=70.0)).score.consistency
    assert found is not None
    assert found.position is not None
    assert found.position.samples == 1001
    assert found.position.mean == pytest.approx(3.0, abs=0.3)


def test_errors_count_anew_after_a_reset() -> None:
    truth = flight()
    half = len(truth) // 2
    again = moved(truth, yaw(120.0), (-5.0, 2.0, 8.0))
    p = np.vstack([truth.p_m[:half], again.p_m[half:]])
    rotation = Rotation.concatenate([truth.rotation[:half], again.rotation[half:]])
    assert truth.v_m_s is not None
    assert again.v_m_s is not None
    est = Trajectory("reset", truth.t_ns, p, rotation, np.vstack([truth.v_m_s[:half], again.v_m_s[half:]]))
    covariances = constant([np.eye(3)] * 3, len(truth))
    estimate = replace(estimate_of(est, covariances), reset_count=np.repeat([0, 1], [half, len(truth) - half]))

    errors = filter_errors(associate(truth_of(truth), estimate, 0.01))
    for values in (errors.position_m, errors.velocity_m_s, errors.attitude_rad):
        assert values == pytest.approx(np.zeros_like(values), abs=1e-9)
    result = score(truth_of(truth), estimate, Options()).score
    assert result.resets == 1
    assert any("anew" in note for note in result.notes)


def test_without_covariance_there_is_no_nees() -> None:
    truth = flight()
    assert score(truth_of(truth), estimate_of(truth), Options()).score.consistency is None
