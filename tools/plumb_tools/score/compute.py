"""The whole score of an estimate, as data; printing and plotting are elsewhere."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from plumb_tools.score import align, motion
from plumb_tools.score.align import Alignment
from plumb_tools.score.consistency import Consistency, consistency
from plumb_tools.score.errors import AlignedErrors, summarise
from plumb_tools.score.estimate import Estimate
from plumb_tools.score.motion import Coverage, SegmentError, Standstill
from plumb_tools.score.pairs import Pairs, associate, require_enough, seconds
from plumb_tools.trajectory import NS_PER_S, Truth

SCHEMA = "plumb-score/1"

DEFAULT_MAX_TIME_DIFF_S = 0.01


@dataclass(frozen=True)
class Options:
    """What the user may choose. Times in seconds after the start of the truth's span."""

    max_time_diff_s: float = DEFAULT_MAX_TIME_DIFF_S
    alignment: str = "4dof"  #: 4dof, se3, sim3 or none: the one to plot and to point out
    start_s: float | None = None
    end_s: float | None = None


@dataclass(frozen=True)
class Score:
    """All figures of one run. Keys of `alignments`: start, 4dof, se3, sim3, and none when asked for."""

    truth: str
    estimate: str
    span_source: str  #: what the span is taken from: images or truth
    pairs: int
    distance_m: float  #: of the truth over the scored poses
    path_ratio: float | None  #: path of the estimate over that of the truth
    scale: float | None  #: true size over estimated size, from Sim(3)
    early_scale: float | None  #: estimated over true displacement from 10 to 12 s after the first output
    resets: int
    coverage: Coverage
    selected: str
    alignments: dict[str, AlignedErrors | None]
    segments: list[SegmentError]
    consistency: Consistency | None
    standstill: Standstill | None
    notes: list[str] = field(default_factory=list)

    def as_json(self) -> dict[str, Any]:
        """A tree of plain values; what does not apply is None."""
        tree = _finite({"schema": SCHEMA, **asdict(self)})
        assert isinstance(tree, dict)
        return tree


@dataclass(frozen=True)
class Scored:
    """The figures with what they were made from, for plotting."""

    score: Score
    pairs: Pairs
    alignments: dict[str, Alignment | None]


def score(truth: Truth, estimate: Estimate, options: Options) -> Scored:
    """Scores an estimate against the truth."""
    whole = associate(truth, estimate, options.max_time_diff_s)
    span_s = (truth.span_ns[1] - truth.span_ns[0]) / NS_PER_S
    start = -math.inf if options.start_s is None else options.start_s
    end = math.inf if options.end_s is None else options.end_s
    pairs = whole.select((whole.t_s >= start) & (whole.t_s <= end))
    require_enough(len(pairs), truth.trajectory, estimate.trajectory, options.max_time_diff_s)

    alignments = _alignments(pairs, options.alignment)
    truth_distance, est_distance = motion.distances(pairs)
    sim3 = alignments["sim3"]
    est_s = seconds(estimate.trajectory.t_ns, truth.span_ns[0])
    figures = Score(
        truth=truth.trajectory.name,
        estimate=estimate.trajectory.name,
        span_source=truth.span_source,
        pairs=len(pairs),
        distance_m=truth_distance,
        path_ratio=est_distance / truth_distance if truth_distance > 0.0 else None,
        scale=None if sim3 is None else sim3.scale,
        early_scale=motion.early_scale(pairs),
        resets=int(pairs.reset_count[-1] - pairs.reset_count[0]),
        coverage=motion.coverage(est_s, max(start, 0.0), min(end, span_s)),
        selected=options.alignment,
        alignments={
            name: None if transform is None else summarise(pairs, transform, truth_distance)
            for name, transform in alignments.items()
        },
        segments=motion.segment_errors(pairs, truth_distance),
        consistency=consistency(whole, start, end),
        standstill=motion.standstill(truth.trajectory, truth.span_ns[0], pairs, start, end),
        notes=_notes(truth, estimate, whole, alignments),
    )
    return Scored(figures, pairs, alignments)


def _alignments(pairs: Pairs, selected: str) -> dict[str, Alignment | None]:
    found: dict[str, Alignment | None] = {
        "start": align.at_pose(pairs.truth_p_m[0], pairs.truth_rotation[0], pairs.est_p_m[0], pairs.est_rotation[0]),
        "4dof": align.four_dof(pairs.truth_p_m, pairs.truth_rotation, pairs.est_p_m, pairs.est_rotation),
        "se3": align.umeyama(pairs.truth_p_m, pairs.est_p_m, with_scale=False),
        "sim3": align.umeyama(pairs.truth_p_m, pairs.est_p_m, with_scale=True),
    }
    if selected == "none":
        found["none"] = align.identity()
    return found


def _notes(truth: Truth, estimate: Estimate, whole: Pairs, alignments: dict[str, Alignment | None]) -> list[str]:
    """What the reader should know about this run before trusting a figure."""
    notes = list(estimate.notes)
    if alignments["se3"] is None:
        notes.append("SE(3) and Sim(3): the positions do not determine the alignment")
    first_s = seconds(estimate.trajectory.t_ns[:1], truth.span_ns[0])[0]
    if whole.covariances is not None and whole.t_s[0] > first_s:
        late = whole.t_s[0] - first_s
        notes.append(f"NEES counts from {late:.3f} s after the first output: there is no truth before")
    if np.any(np.diff(whole.reset_count)):
        notes.append("the estimator started anew during the run; NEES counts from each start")
    return notes


def _finite(tree: object) -> object:
    """The same tree with None in place of numbers that JSON cannot hold."""
    if isinstance(tree, dict):
        return {key: _finite(value) for key, value in tree.items()}
    if isinstance(tree, list | tuple):
        return [_finite(value) for value in tree]
    if isinstance(tree, float) and not math.isfinite(tree):
        return None
    return tree
