"""All that the report is made of: a flight with one or two replays of it, brought together with the truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from plumb_tools.report import theme
from plumb_tools.report.analysis import Errors, errors_of, pairs_of
from plumb_tools.report.flight import Flight
from plumb_tools.report.headline import Cost, Headline, cost_of, headline_of
from plumb_tools.report.run import RangeOutcome, Run
from plumb_tools.score.compute import Score
from plumb_tools.score.motion import path_vertices
from plumb_tools.score.pairs import Pairs
from plumb_tools.trajectory import FloatArray, IntArray

#: Steps of the path shorter than this add no distance: noise while hovering is not travel.
DISTANCE_STEP_M = 0.05


@dataclass(frozen=True)
class Judged:
    """A replay against the truth."""

    pairs: Pairs
    errors: Errors
    headline: Headline
    score: Score


@dataclass(frozen=True)
class Replay:
    """A replay with its colour, its path and, where there is truth, its errors."""

    run: Run
    colour: str
    cost: Cost
    t_s: FloatArray  #: (N,) of the path
    path_m: FloatArray  #: (N, 3) in the truth's world after alignment at the start, else in the estimate's own
    judged: Judged | None

    @property
    def label(self) -> str:
        """Name of the replay in legends."""
        return self.run.label


@dataclass(frozen=True)
class Ground:
    """Where the laser met the surface, from the truth's poses where there are any, else from the estimate's."""

    t_s: FloatArray
    point_m: FloatArray  #: (N, 3)
    distance_m: FloatArray  #: travelled until then
    outcome: IntArray


@dataclass(frozen=True)
class Model:
    """A flight and its replays; the first one is range-VIO."""

    flight: Flight
    replays: list[Replay]
    duration_s: float
    absent: dict[str, str]  #: replays that gave no solution, and why

    @property
    def main(self) -> Replay:
        """The replay that the report is about; the other one is for comparison."""
        return self.replays[0]

    @property
    def reference_path(self) -> tuple[FloatArray, FloatArray]:
        """Stamps [s] and positions [m] of the truth at the poses of the first replay, else of that replay itself."""
        judged = self.main.judged
        return (self.main.t_s, self.main.path_m if judged is None else judged.pairs.truth_p_m)


def build(flight: Flight, runs: list[Run], absent: dict[str, str] | None = None) -> Model:
    """Brings a flight and its replays together."""
    replays = [_replay(flight, run, theme.colour_of(run.label)) for run in runs]
    return Model(flight, replays, float(flight.seconds(flight.t_images_ns[-1:])[0]), absent or {})


def _replay(flight: Flight, run: Run, colour: str) -> Replay:
    cost = cost_of(run)
    trajectory = run.estimate.trajectory
    if flight.truth is None:
        return Replay(run, colour, cost, flight.seconds(trajectory.t_ns), trajectory.p_m, None)
    pairs = pairs_of(flight.truth, run.estimate)
    errors = errors_of(pairs)
    headline, figures = headline_of(flight.truth, run)
    path = pairs.truth_p_m + errors.position_m
    return Replay(run, colour, cost, pairs.t_s, path, Judged(pairs, errors, headline, figures))


def travelled(path_m: FloatArray) -> FloatArray:
    """Distance along a path (N, 3) up to each of its poses, (N,)."""
    vertices = path_vertices(path_m, DISTANCE_STEP_M)
    steps = np.linalg.norm(np.diff(path_m[vertices], axis=0), axis=1)
    return np.interp(np.arange(len(path_m)), vertices, np.concatenate([[0.0], np.cumsum(steps)]))


def ground_of(model: Model) -> Ground | None:
    """Surface points under the laser; None without range finder or without a single range at a known pose."""
    if model.flight.range_finder is None:
        return None
    states = model.main.run.states
    t_s, path_m = model.reference_path
    rotation = _rotations(model)
    state_t_s = model.flight.seconds(states.t_ns)
    returned = (states["range_measured_m"] > 0.0) & (states["range_outcome"] != RangeOutcome.NONE)
    rows = np.flatnonzero(returned & np.isin(state_t_s, t_s))
    if not rows.size:
        return None
    at = np.searchsorted(t_s, state_t_s[rows])
    points = path_m[at] + rotation[at].apply(model.flight.beam_points_I_m(states["range_measured_m"][rows]))
    return Ground(state_t_s[rows], points, travelled(path_m)[at], states["range_outcome"][rows].astype(np.int64))


def _rotations(model: Model) -> Rotation:
    judged = model.main.judged
    return model.main.run.estimate.trajectory.rotation if judged is None else judged.pairs.truth_rotation
