"""Association of an estimate with the truth in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from evo.core.sync import matching_time_indices
from evo.core.trajectory import PoseTrajectory3D
from scipy.spatial.transform import Rotation

from plumb_tools.score.estimate import Covariances, Estimate
from plumb_tools.trajectory import NS_PER_S, FloatArray, InputError, IntArray, Trajectory, Truth

#: Fewer pairs than this do not make a score.
MIN_PAIRS = 10

#: Stamps written with microseconds may fall this far outside the truth by rounding; such a pose takes the end pose.
END_TOLERANCE_S = 1e-6

#: Half width of the difference that gives the velocity where the truth file has none [s].
VELOCITY_HALF_WINDOW_S = 0.025


@dataclass(frozen=True)
class Pairs:
    """Estimated poses and the truth interpolated to their stamps. Each in its own z-up world frame."""

    t_s: FloatArray  #: (N,) since the start of the truth's span
    truth_p_m: FloatArray
    truth_rotation: Rotation  #: body to world
    truth_v_m_s: FloatArray
    est_p_m: FloatArray
    est_rotation: Rotation  #: body to world
    est_v_m_s: FloatArray | None
    covariances: Covariances | None
    reset_count: IntArray  #: (N,) re-initialisations of the estimator so far

    def __len__(self) -> int:
        """Number of pairs."""
        return len(self.t_s)

    def select(self, keep: npt.NDArray[np.bool_]) -> Pairs:
        """The pairs where `keep` is true."""
        return Pairs(
            self.t_s[keep],
            self.truth_p_m[keep],
            self.truth_rotation[keep],
            self.truth_v_m_s[keep],
            self.est_p_m[keep],
            self.est_rotation[keep],
            None if self.est_v_m_s is None else self.est_v_m_s[keep],
            None if self.covariances is None else self.covariances.select(keep),
            self.reset_count[keep],
        )


def central_velocity(t_s: FloatArray, p_m: FloatArray, at_s: FloatArray, half_window_s: float) -> FloatArray:
    """Velocity (N, 3) at given times as the difference of positions half a window before and after.

    Positions between stamps are interpolated linearly; at the ends the difference is one-sided.
    """
    before = np.clip(at_s - half_window_s, t_s[0], t_s[-1])
    after = np.clip(at_s + half_window_s, t_s[0], t_s[-1])
    rise = np.column_stack([np.interp(after, t_s, p) - np.interp(before, t_s, p) for p in p_m.T])
    return np.asarray(rise / (after - before)[:, None])


def seconds(t_ns: IntArray, origin_ns: int) -> FloatArray:
    """Stamps in seconds since an origin: exact to the nanosecond over months."""
    return np.asarray((t_ns - origin_ns) / NS_PER_S, dtype=np.float64)


def _truth_velocity(truth: Trajectory, truth_s: FloatArray, at_s: FloatArray) -> FloatArray:
    if truth.v_m_s is not None:
        return np.column_stack([np.interp(at_s, truth_s, v) for v in truth.v_m_s.T])
    half_window = max(VELOCITY_HALF_WINDOW_S, float(np.median(np.diff(truth_s))))
    return central_velocity(truth_s, truth.p_m, at_s, half_window)


def poses_at(trajectory: Trajectory, t_s: FloatArray, origin_ns: int) -> tuple[FloatArray, Rotation]:
    """Positions and rotations interpolated to times in seconds since an origin."""
    stamps_s = seconds(trajectory.t_ns, origin_ns)
    path = PoseTrajectory3D(trajectory.p_m, trajectory.rotation.as_quat(scalar_first=True), stamps_s)
    at = path.interpolate(t_s)
    return np.asarray(at.positions_xyz), Rotation.from_quat(at.orientations_quat_wxyz, scalar_first=True)


def _no_overlap(truth: Trajectory, est: Trajectory, max_time_diff_s: float) -> InputError:
    def span(trajectory: Trajectory) -> str:
        first, last = trajectory.t_ns[0] / NS_PER_S, trajectory.t_ns[-1] / NS_PER_S
        return f"{first:.6f} to {last:.6f} s ({len(trajectory)} poses)  {trajectory.name}"

    return InputError(
        f"truth and estimate do not overlap in time (poses within {max_time_diff_s:g} s of each other)\n"
        f"  truth:    {span(truth)}\n  estimate: {span(est)}\n"
        "Are both in the same time base and unit?"
    )


def associate(truth: Truth, estimate: Estimate, max_time_diff_s: float) -> Pairs:
    """Pairs of all estimated poses that have a true pose within `max_time_diff_s`, not outside the truth's stamps."""
    true, est = truth.trajectory, estimate.trajectory
    if len(true) < 2:
        raise InputError(f"{true.name}: a truth of one pose cannot be scored against")
    origin = truth.span_ns[0]
    truth_s, est_s = seconds(true.t_ns, origin), seconds(est.t_ns, origin)
    near, _ = matching_time_indices(est_s, truth_s, max_time_diff_s)
    index = np.array(near, dtype=np.int64)
    index = index[(est_s[index] >= truth_s[0] - END_TOLERANCE_S) & (est_s[index] <= truth_s[-1] + END_TOLERANCE_S)]
    if index.size == 0:
        raise _no_overlap(true, est, max_time_diff_s)
    require_enough(index.size, true, est, max_time_diff_s)
    t_s = est_s[index]
    p_m, rotation = poses_at(true, t_s, origin)
    return Pairs(
        t_s,
        p_m,
        rotation,
        _truth_velocity(true, truth_s, t_s),
        est.p_m[index],
        est.rotation[index],
        None if est.v_m_s is None else est.v_m_s[index],
        None if estimate.covariances is None else estimate.covariances.select(index),
        estimate.reset_count[index],
    )


def require_enough(pairs: int, truth: Trajectory, est: Trajectory, max_time_diff_s: float) -> None:
    """Refuses what is too little to score."""
    if pairs < MIN_PAIRS:
        raise InputError(
            f"{est.name}: {pairs} of {len(est)} poses can be compared with {truth.name}; expected at least {MIN_PAIRS} "
            f"poses within {max_time_diff_s:g} s of a true one (--max-time-diff) and within --start and --end"
        )
