"""The figures by which a flight is judged first: one row of a table, one card of the report."""

from __future__ import annotations

from dataclasses import dataclass

from plumb_tools.report.run import Run
from plumb_tools.score.compute import Options, Score, score
from plumb_tools.score.consistency import Nees
from plumb_tools.trajectory import Truth

US_PER_MS = 1000.0


@dataclass(frozen=True)
class Headline:
    """Figures of one replay against the truth. Errors per axis are those after alignment at the first pose."""

    distance_m: float
    max_axis_m: float  #: greatest position error on any axis at any time
    max_axis_percent: float | None  #: of the distance travelled; None without motion
    ate_m: float  #: root mean square after alignment in position and yaw over the run
    scale_error_percent: float | None  #: estimated over true size, minus one
    early_scale_error_percent: float | None  #: the same from 10 to 12 s after the first state
    velocity_rmse_m_s: float
    nees_position: float | None  #: means; 3 is ideal
    nees_velocity: float | None
    nees_attitude: float | None
    first_state_s: float  #: after the first image
    coverage_percent: float  #: of the flight
    resets: int


@dataclass(frozen=True)
class Cost:
    """What a replay cost."""

    cpu_ms: float  #: CPU time per image, front end included, mean
    cpu_p95_ms: float
    realtime_factor: float  #: length of the flight over the wall time of the replay


def headline_of(truth: Truth, run: Run) -> tuple[Headline, Score]:
    """Figures of a replay, and the whole score they are taken from."""
    figures = score(truth, run.estimate, Options()).score
    start, fitted = figures.alignments["start"], figures.alignments["4dof"]
    assert start is not None and fitted is not None and start.velocity_rmse_m_s is not None
    percent = start.axis_max_percent
    parts = figures.consistency
    headline = Headline(
        figures.distance_m,
        max(start.axis_max_m),
        None if percent is None else max(percent),
        fitted.ate_rmse_m,
        _scale_error_percent(figures),
        None if figures.early_scale is None else 100.0 * (figures.early_scale - 1.0),
        start.velocity_rmse_m_s,
        *(_mean(getattr(parts, name, None)) for name in ("position", "velocity", "attitude")),
        figures.coverage.first_output_s,
        100.0 * figures.coverage.covered,
        figures.resets,
    )
    return headline, figures


def cost_of(run: Run) -> Cost:
    """CPU and wall time of a replay, as plumb-replay measured them."""
    step = run.timing["step_us"] / US_PER_MS
    ordered = sorted(step)
    p95 = ordered[min(len(ordered) - 1, round(0.95 * (len(ordered) - 1)))]
    wall_s = float(run.summary["wall_s"])
    factor = float(run.summary["image_span_s"]) / wall_s if wall_s > 0.0 else float("inf")
    return Cost(float(step.mean()), float(p95), factor)


def _mean(part: Nees | None) -> float | None:
    return None if part is None else part.mean


def _scale_error_percent(figures: Score) -> float | None:
    """From Sim(3), and from the length of the path where the positions do not determine that."""
    if figures.scale is not None:
        return 100.0 * (1.0 / figures.scale - 1.0)
    return None if figures.path_ratio is None else 100.0 * (figures.path_ratio - 1.0)
