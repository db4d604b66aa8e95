"""Is the filter's covariance honest: normalised estimation error squared (NEES).

The estimate starts with position and yaw zero and known exactly, so its errors are those against a truth moved into
its world frame by position and yaw at its first pose. Another alignment would spread the error of the whole run
over the start and make the figure meaningless.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from plumb_tools.score import align
from plumb_tools.score.pairs import Pairs
from plumb_tools.trajectory import FloatArray

DIMENSION = 3
CONFIDENCE = 0.95

#: A block whose smallest eigenvalue is below this part of its greatest is singular to rounding: it has no inverse.
MIN_EIGENVALUE_RATIO = 1e-12


@dataclass(frozen=True)
class Nees:
    """NEES of one three-dimensional error over a run; 3 is ideal, more is overconfident, less is timid."""

    mean: float
    median: float  #: 2.37 is ideal
    lower: float  #: 95 % bounds of the mean of that many independent samples
    upper: float
    inside: float  #: fraction of samples within the filter's own 95 % ellipsoid; 0.95 is ideal
    samples: int
    skipped: int  #: samples with a covariance that cannot be inverted


@dataclass(frozen=True)
class Consistency:
    """NEES of position, velocity and attitude."""

    position: Nees | None
    velocity: Nees | None
    attitude: Nees | None


@dataclass(frozen=True)
class FilterErrors:
    """Estimate minus truth in the estimate's own frames, (N, 3) each: what the covariance describes."""

    position_m: FloatArray  #: in W
    velocity_m_s: FloatArray  #: in W
    attitude_rad: FloatArray  #: local: Log(R_hat^T R)


def chi2_mean_bounds(samples: int) -> tuple[float, float]:
    """95 % bounds of the mean of independent NEES samples of three dimensions."""
    tail = 0.5 * (1.0 - CONFIDENCE)
    lower, upper = chi2.ppf([tail, 1.0 - tail], DIMENSION * samples) / samples
    return float(lower), float(upper)


def nees_values(errors: FloatArray, covariances: FloatArray) -> FloatArray:
    """e^T P^-1 e of errors (N, 3) and covariances (N, 3, 3); NaN where P is not positive definite."""
    values = np.full(len(errors), np.nan)
    symmetric = 0.5 * (covariances + np.swapaxes(covariances, 1, 2))
    eigenvalues = np.linalg.eigvalsh(symmetric)
    good = (eigenvalues[:, 0] > 0.0) & (eigenvalues[:, 0] >= MIN_EIGENVALUE_RATIO * eigenvalues[:, -1])
    solved = np.linalg.solve(symmetric[good], errors[good][:, :, None])[:, :, 0]
    values[good] = np.sum(errors[good] * solved, axis=1)
    return values


def nees(errors: FloatArray, covariances: FloatArray) -> Nees | None:
    """Summary over a run; None when no sample can be used."""
    values = nees_values(errors, covariances)
    usable = values[np.isfinite(values)]
    if not usable.size:
        return None
    lower, upper = chi2_mean_bounds(usable.size)
    inside = float(np.mean(usable <= chi2.ppf(CONFIDENCE, DIMENSION)))
    skipped = len(values) - usable.size
    return Nees(float(usable.mean()), float(np.median(usable)), lower, upper, inside, int(usable.size), skipped)


def filter_errors(pairs: Pairs) -> FilterErrors:
    """Errors after moving the truth onto the first pose of the estimate, and anew after each reset."""
    position, velocity, attitude = (np.zeros((len(pairs), DIMENSION)) for _ in range(3))
    for count in np.unique(pairs.reset_count):
        run = np.flatnonzero(pairs.reset_count == count)
        first = run[0]
        to_estimate = align.at_pose(
            pairs.est_p_m[first], pairs.est_rotation[first], pairs.truth_p_m[first], pairs.truth_rotation[first]
        )
        position[run] = pairs.est_p_m[run] - to_estimate.positions(pairs.truth_p_m[run])
        if pairs.est_v_m_s is not None:
            velocity[run] = pairs.est_v_m_s[run] - to_estimate.velocities(pairs.truth_v_m_s[run])
        truth_rotation = to_estimate.rotations(pairs.truth_rotation[run])
        attitude[run] = (pairs.est_rotation[run].inv() * truth_rotation).as_rotvec()
    return FilterErrors(position, velocity, attitude)


def consistency(pairs: Pairs, start_s: float, end_s: float) -> Consistency | None:
    """NEES over [start, end]; `pairs` are those of the whole run, because errors count from its first pose."""
    if pairs.covariances is None:
        return None
    errors = filter_errors(pairs)
    _, firsts = np.unique(pairs.reset_count, return_index=True)
    use = (pairs.t_s >= start_s) & (pairs.t_s <= end_s)
    use[firsts] = False  # the errors there are zero by construction
    covariances = pairs.covariances
    return Consistency(
        nees(errors.position_m[use], covariances.position[use]),
        nees(errors.velocity_m_s[use], covariances.velocity[use]),
        nees(errors.attitude_rad[use], covariances.attitude[use]),
    )
