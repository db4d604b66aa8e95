"""What depends on how the truth moved: distance, drift over segments, coverage and standstill."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from evo.core.filters import FilterException
from evo.core.metrics import RPE, PoseRelation, StatisticsType
from evo.core.units import Unit

from plumb_tools.score.errors import evo_path
from plumb_tools.score.pairs import Pairs, central_velocity, seconds
from plumb_tools.trajectory import FloatArray, IntArray, Trajectory

#: Truth poses nearer than this to the last counted one add no distance: noise while standing still is not travel.
DISTANCE_STEP_M = 0.01

#: Vertices used at most for the drift over segments, whose cost grows with their square.
MAX_SEGMENT_VERTICES = 2000

SEGMENT_LENGTHS_M = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0)
MAX_SEGMENT_LENGTHS = 4
SEGMENT_TOLERANCE = 0.1  #: a pair counts when its distance is this near to the segment length, relative

#: The estimate does not cover a gap longer than this (or 1.5 of its own period, when that is more) [s].
COVERAGE_GAP_S = 0.5
COVERAGE_GAP_PERIODS = 1.5

#: When the scale that a start found is looked at, after the first output, and over which displacement at least.
EARLY_SCALE_S = (10.0, 12.0)
EARLY_SCALE_MIN_M = 1.0

STANDSTILL_SPEED_M_S = 0.02
STANDSTILL_HALF_WINDOW_S = 0.1  #: of the difference that gives the truth's speed
STANDSTILL_SETTLE_S = 1.0
STANDSTILL_MIN_S = 2.0


@dataclass(frozen=True)
class Coverage:
    """How much of the span the estimate covers."""

    span_s: float
    covered: float  #: fraction of the span
    first_output_s: float  #: after the start of the span
    longest_gap_s: float  #: between the estimate's stamps, the ends of the span included


@dataclass(frozen=True)
class SegmentError:
    """Relative pose error over segments of one length of the truth's path."""

    length_m: float
    translation_rmse_m: float
    translation_percent: float  #: of the length
    rotation_rmse_deg: float
    pairs: int


@dataclass(frozen=True)
class Standstill:
    """Drift of the estimate while the truth stands still at the end."""

    duration_s: float
    drift_m: float  #: largest displacement from the place held one second into the standstill
    truth_drift_m: float  #: the same of the truth: what cannot be told from drift


def early_scale(pairs: Pairs) -> float | None:
    """Displacement of the estimate over that of the truth, from 10 to 12 s after the first output; None without one."""
    begin, end = (int(np.searchsorted(pairs.t_s, pairs.t_s[0] + after_s)) for after_s in EARLY_SCALE_S)
    if end >= len(pairs):
        return None
    truth_m, est_m = (float(np.linalg.norm(p_m[end] - p_m[begin])) for p_m in (pairs.truth_p_m, pairs.est_p_m))
    return est_m / truth_m if truth_m >= EARLY_SCALE_MIN_M else None


def path_vertices(p_m: FloatArray, step_m: float) -> IntArray:
    """Indices of the positions (N, 3) that are at least a step from the previously chosen one."""
    chosen = [0]
    for index in range(1, len(p_m)):
        step = p_m[index] - p_m[chosen[-1]]
        if float(step @ step) >= step_m * step_m:
            chosen.append(index)
    return np.array(chosen, dtype=np.int64)


def path_length(p_m: FloatArray) -> float:
    """Length of a polyline (N, 3)."""
    return float(np.linalg.norm(np.diff(p_m, axis=0), axis=1).sum())


def distances(pairs: Pairs) -> tuple[float, float]:
    """Distance travelled by the truth and by the estimate over the same vertices [m]."""
    vertices = path_vertices(pairs.truth_p_m, DISTANCE_STEP_M)
    return path_length(pairs.truth_p_m[vertices]), path_length(pairs.est_p_m[vertices])


def segment_errors(pairs: Pairs, distance_m: float) -> list[SegmentError]:
    """Relative pose errors over the longest few of the standard lengths that fit into the path; all pairs."""
    lengths = [length for length in SEGMENT_LENGTHS_M if length <= distance_m][-MAX_SEGMENT_LENGTHS:]
    if not lengths:
        return []
    vertices = path_vertices(pairs.truth_p_m, max(DISTANCE_STEP_M, distance_m / MAX_SEGMENT_VERTICES))
    truth = evo_path(pairs.truth_p_m[vertices], pairs.truth_rotation[vertices])
    est = evo_path(pairs.est_p_m[vertices], pairs.est_rotation[vertices])
    found = []
    for length in lengths:
        rmse = {}
        pair_count = 0
        for relation in (PoseRelation.translation_part, PoseRelation.rotation_angle_deg):
            rpe = RPE(relation, length, Unit.meters, SEGMENT_TOLERANCE, all_pairs=True, pairs_from_reference=True)
            try:
                rpe.process_data((truth, est))
            except FilterException:
                logging.getLogger(__name__).debug("no pair of poses %g m apart", length)
                break
            rmse[relation] = float(rpe.get_statistic(StatisticsType.rmse))
            pair_count = len(rpe.error)
        if pair_count:
            translation = rmse[PoseRelation.translation_part]
            rotation = rmse[PoseRelation.rotation_angle_deg]
            found.append(SegmentError(length, translation, 100.0 * translation / length, rotation, pair_count))
    return found


def coverage(est_s: FloatArray, start_s: float, end_s: float) -> Coverage:
    """Part of [start, end] that the estimate's stamps cover without long gaps."""
    inside = est_s[(est_s >= start_s) & (est_s <= end_s)]
    if len(inside) < 2 or end_s <= start_s:
        return Coverage(max(end_s - start_s, 0.0), 0.0, float("nan"), end_s - start_s)
    gaps = np.diff(inside)
    allowed = max(COVERAGE_GAP_S, COVERAGE_GAP_PERIODS * float(np.median(gaps)))
    span = end_s - start_s
    longest = max(float(gaps.max()), float(inside[0]) - start_s, end_s - float(inside[-1]))
    return Coverage(span, float(gaps[gaps <= allowed].sum()) / span, float(inside[0]) - start_s, longest)


def standstill(truth: Trajectory, origin_ns: int, pairs: Pairs, start_s: float, end_s: float) -> Standstill | None:
    """Drift in the standstill that ends the interval; None when the truth is moving at its end."""
    truth_s = seconds(truth.t_ns, origin_ns)
    inside = (truth_s >= start_s) & (truth_s <= end_s)
    stamps, positions = truth_s[inside], truth.p_m[inside]
    if len(stamps) < 2:
        return None
    speed = np.linalg.norm(central_velocity(stamps, positions, stamps, STANDSTILL_HALF_WINDOW_S), axis=1)
    moving = np.flatnonzero(speed >= STANDSTILL_SPEED_M_S)
    began = float(stamps[moving[-1]]) if moving.size else float(stamps[0])
    still = pairs.t_s >= began + STANDSTILL_SETTLE_S
    if stamps[-1] - began < STANDSTILL_MIN_S or np.count_nonzero(still) < 2:
        return None
    est, true = pairs.est_p_m[still], pairs.truth_p_m[still]
    return Standstill(
        float(stamps[-1]) - began,
        float(np.linalg.norm(est - est[0], axis=1).max()),
        float(np.linalg.norm(true - true[0], axis=1).max()),
    )
