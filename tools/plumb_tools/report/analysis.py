"""Series over time that the figures show: errors with their bounds, NEES, scale, stretches of one mode."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

from plumb_tools.score import align, consistency
from plumb_tools.score.estimate import Estimate
from plumb_tools.score.pairs import Pairs, associate
from plumb_tools.trajectory import FloatArray, IntArray, Truth

MAX_TIME_DIFF_S = 0.01
SIGMAS = 3.0

#: Scale is that of the path inside a sliding window: this long at least, else this part of the flight.
SCALE_WINDOW_S = 5.0
SCALE_WINDOW_PART = 1.0 / 15.0
#: A window in which the truth spreads less than this around its centre has no scale.
SCALE_MIN_SPREAD_M = 0.1

#: Bounds between which 95 % of the NEES samples of an honest three-dimensional error lie.
NEES_BOUNDS = (float(chi2.ppf(0.025, consistency.DIMENSION)), float(chi2.ppf(0.975, consistency.DIMENSION)))


@dataclass(frozen=True)
class Errors:
    """Estimate minus truth, (N, 3) each, in the truth's world frame, z up.

    Both are brought together in position and yaw at the first pose, and anew after each re-initialisation.
    `sigma_*` are the filter's own standard deviations along the same axes.
    """

    t_s: FloatArray
    position_m: FloatArray
    velocity_m_s: FloatArray
    attitude_rad: FloatArray  #: rotation vector of the error about the world's axes; z is heading
    sigma_position_m: FloatArray
    sigma_velocity_m_s: FloatArray
    sigma_attitude_rad: FloatArray
    nees_position: FloatArray
    nees_velocity: FloatArray
    nees_attitude: FloatArray


@dataclass(frozen=True)
class Stretch:
    """A stretch of time with one value."""

    start_s: float
    end_s: float
    value: int


def pairs_of(truth: Truth, estimate: Estimate) -> Pairs:
    """Estimated poses with the truth at their stamps."""
    return associate(truth, estimate, MAX_TIME_DIFF_S)


def _sigmas(covariances: FloatArray, turn: FloatArray) -> FloatArray:
    """Standard deviations (N, 3) along the axes that `turn` (3, 3) or (N, 3, 3) takes the covariances to."""
    turned = turn @ covariances @ np.swapaxes(turn, -1, -2)
    return np.asarray(np.sqrt(np.maximum(np.diagonal(turned, axis1=1, axis2=2), 0.0)))


def errors_of(pairs: Pairs) -> Errors:
    """Errors, bounds and NEES of a replay."""
    assert pairs.covariances is not None and pairs.est_v_m_s is not None  # a folder of plumb-replay has both
    count = len(pairs)
    position, velocity, attitude = (np.zeros((count, 3)) for _ in range(3))
    sigma_p, sigma_v, sigma_a = (np.zeros((count, 3)) for _ in range(3))
    for reset in np.unique(pairs.reset_count):
        run = np.flatnonzero(pairs.reset_count == reset)
        first = run[0]
        to_truth = align.at_pose(
            pairs.truth_p_m[first], pairs.truth_rotation[first], pairs.est_p_m[first], pairs.est_rotation[first]
        )
        attitude_W = to_truth.rotations(pairs.est_rotation[run])
        position[run] = to_truth.positions(pairs.est_p_m[run]) - pairs.truth_p_m[run]
        velocity[run] = to_truth.velocities(pairs.est_v_m_s[run]) - pairs.truth_v_m_s[run]
        attitude[run] = (attitude_W * pairs.truth_rotation[run].inv()).as_rotvec()
        yaw = to_truth.rotation.as_matrix()
        sigma_p[run] = _sigmas(pairs.covariances.position[run], yaw)
        sigma_v[run] = _sigmas(pairs.covariances.velocity[run], yaw)
        sigma_a[run] = _sigmas(pairs.covariances.attitude[run], attitude_W.as_matrix())
    own = consistency.filter_errors(pairs)
    nees = [
        consistency.nees_values(own.position_m, pairs.covariances.position),
        consistency.nees_values(own.velocity_m_s, pairs.covariances.velocity),
        consistency.nees_values(own.attitude_rad, pairs.covariances.attitude),
    ]
    return Errors(pairs.t_s, position, velocity, attitude, sigma_p, sigma_v, sigma_a, *nees)


def scale_window_s(duration_s: float) -> float:
    """Width of the sliding window in which scale is measured."""
    return max(SCALE_WINDOW_S, SCALE_WINDOW_PART * duration_s)


def sliding_scale(pairs: Pairs, window_s: float) -> FloatArray:
    """Estimated over true size of the path within a window around each pose, (N,); NaN where it has no size.

    Size is the root mean square distance from the centre, which needs no alignment. Windows do not reach over a
    re-initialisation or beyond the ends of the run.
    """
    scale = np.full(len(pairs), np.nan)
    half = 0.5 * window_s
    starts = np.searchsorted(pairs.t_s, pairs.t_s - half)
    ends = np.searchsorted(pairs.t_s, pairs.t_s + half, side="right")
    for index, (start, end) in enumerate(zip(starts, ends, strict=True)):
        whole = pairs.t_s[index] - half >= pairs.t_s[0] and pairs.t_s[index] + half <= pairs.t_s[-1]
        if not whole or pairs.reset_count[start] != pairs.reset_count[end - 1]:
            continue
        true = np.sqrt(pairs.truth_p_m[start:end].var(axis=0).sum())
        if true >= SCALE_MIN_SPREAD_M:
            scale[index] = np.sqrt(pairs.est_p_m[start:end].var(axis=0).sum()) / true
    return scale


def stretches(t_s: FloatArray, values: IntArray) -> list[Stretch]:
    """Stretches of equal value; each lasts until the next begins, the last until the last stamp."""
    starts = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1])
    ends = np.append(starts[1:], len(values) - 1)
    return [Stretch(float(t_s[i]), float(t_s[j]), int(values[i])) for i, j in zip(starts, ends, strict=True)]


def thinned(count: int, limit: int) -> IntArray:
    """At most `limit` of `count` indices, evenly spread, first and last among them."""
    if count <= limit:
        return np.arange(count, dtype=np.int64)
    return np.unique(np.linspace(0, count - 1, limit).round().astype(np.int64))


def worst_of_blocks(totals: FloatArray, limit: int) -> IntArray:
    """The index of the greatest total in each of at most `limit` blocks: thinning that hides no spike."""
    edges = np.linspace(0, len(totals), min(limit, len(totals)) + 1).round().astype(np.int64)
    chosen = [start + int(np.argmax(totals[start:end])) for start, end in zip(edges[:-1], edges[1:], strict=True)]
    return np.array(chosen, dtype=np.int64)


def with_gaps(
    t_s: FloatArray, values: FloatArray, gap_s: float
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """A line with a break wherever the time does not go on within `gap_s`."""
    gaps = np.flatnonzero(np.diff(t_s) > gap_s) + 1
    return np.insert(t_s, gaps, np.nan), np.insert(values, gaps, np.nan, axis=0)
