"""Figures of what the filter did: ranges, features, modes and CPU time."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from plumb_tools.report import theme
from plumb_tools.report.analysis import stretches, worst_of_blocks
from plumb_tools.report.headline import US_PER_MS
from plumb_tools.report.model import Model
from plumb_tools.report.panel import MAX_POINTS, Panel, grid, line, time_axis
from plumb_tools.report.run import STAGE_SUFFIX, Mode, RangeOutcome
from plumb_tools.trajectory import FloatArray, IntArray

#: Ranges are single points: more of them than this only slow the page down.
MAX_RANGES = 4000

#: In order of drawing: what was not used lies under what was.
_DRAWN_OUTCOMES = (
    RangeOutcome.SPARE,
    RangeOutcome.USED,
    RangeOutcome.FEATURE,
    RangeOutcome.NO_FACET,
    RangeOutcome.BAD_GEOMETRY,
    RangeOutcome.STALE,
    RangeOutcome.GATED,
)


def range_profile(model: Model) -> Panel | None:
    """Measured ranges by what became of them, with what was predicted for those compared; None without range finder."""
    finder = model.flight.range_finder
    if finder is None:
        return None
    states = model.main.run.states
    t_s = model.flight.seconds(states.t_ns)
    outcome = states["range_outcome"].astype(np.int64)
    figure = grid(1, 1)
    sample_t_s, sample_m = model.flight.seconds(finder.t_ns), np.where(finder.range_m > 0.0, finder.range_m, np.nan)
    figure.add_trace(line(sample_t_s, sample_m, "every sample", theme.faded(theme.MUTED, 0.55), width=1.0))
    predicted = np.where(states["range_predicted_m"] > 0.0, states["range_predicted_m"], np.nan)
    rows = np.flatnonzero(np.isfinite(predicted))
    rows = rows[:: max(1, len(rows) // MAX_RANGES)]
    figure.add_scatter(
        x=t_s[rows],
        y=predicted[rows],
        mode="markers",
        name="predicted by facet or feature",
        marker={"size": 6, "symbol": "line-ew-open", "color": theme.GOOD, "line": {"width": 1.6}},
    )
    for kind in _DRAWN_OUTCOMES:
        _add_ranges(figure, t_s, states["range_measured_m"], np.flatnonzero(outcome == kind), kind)
    silent = sample_t_s[finder.range_m <= 0.0]
    if silent.size:
        marker = {"size": 7, "symbol": "line-ns-open", "color": theme.MUTED, "line": {"width": 1.0}}
        zero = np.zeros(len(silent[: 4 * MAX_RANGES]))
        figure.add_scatter(
            x=silent[: 4 * MAX_RANGES], y=zero, mode="markers", marker=marker, name="no return", hoverinfo="skip"
        )
    figure.update_yaxes(title_text="range [m]", rangemode="tozero", hoverformat=".2f")
    figure.update_traces(hovertemplate="%{y:.2f} m")
    time_axis(figure, model.duration_s, 1)
    caption = (
        "A range goes to the track that starts at the laser's spot; where the spot stays, it is compared with the "
        "feature there. While such tracks and features are of use, other ranges are spared; where there are none, a "
        "range is compared with the facet of three SLAM features under the beam. One that disagrees by more than the "
        "gate is not used. Click in any figure over time to see the image of that moment."
    )
    return Panel("range", "Range profile", caption, figure, 340)


def _add_ranges(
    figure: go.Figure, t_s: FloatArray, measured_m: FloatArray, rows: IntArray, kind: RangeOutcome
) -> None:
    if not rows.size:
        return
    rows = rows[:: max(1, len(rows) // MAX_RANGES)]
    gated = kind == RangeOutcome.GATED
    figure.add_scatter(
        x=t_s[rows],
        y=measured_m[rows],
        mode="markers",
        name=theme.OUTCOME_NAMES[kind],
        marker={
            "size": 8 if gated else 4.5,
            "symbol": theme.OUTCOME_SYMBOLS.get(kind, "circle"),
            "color": theme.OUTCOME_COLOURS[kind],
        },
    )


def features(model: Model) -> Panel:
    """How many features the filter had and used."""
    figure = grid(3, 1, shared_xaxes=True, vertical_spacing=0.05)
    rows = (
        ("tracks", "tracks"),
        ("slam_used", "SLAM used"),
        ("msckf_used", "MSCKF used"),
    )
    for row, (column, title) in enumerate(rows, start=1):
        for replay in model.replays:
            states = replay.run.states
            t_s = model.flight.seconds(states.t_ns)
            curve = line(t_s, states[column], replay.label, replay.colour, showlegend=row == 1, width=1.2)
            figure.add_trace(curve, row=row, col=1)
        figure.update_yaxes(title_text=title, rangemode="tozero", row=row, col=1)
    time_axis(figure, model.duration_s, 3)
    caption = "Per image: features tracked, observations of SLAM features fused, tracks fused once as they ended."
    return Panel("features", "Features", caption, figure, 400)


def modes(model: Model) -> Panel:
    """What the solution rested on, over time."""
    figure = grid(1, 1)
    named: set[str] = set()

    def bar(label: str, start_s: float, end_s: float, name: str, colour: str) -> None:
        figure.add_bar(
            y=[label],
            x=[end_s - start_s],
            base=[start_s],
            orientation="h",
            width=0.62,
            name=name,
            legendgroup=name,
            showlegend=name not in named,
            marker={"color": colour, "line": {"width": 0}},
            hovertemplate=f"{name}<br>{start_s:.2f} to {end_s:.2f} s<extra></extra>",
        )
        named.add(name)

    for replay in reversed(model.replays):
        states = replay.run.states
        t_s = model.flight.seconds(states.t_ns)
        still = f"{replay.label}: standing still"
        for stretch in stretches(t_s, states["zero_velocity"].astype(np.int64)):
            if stretch.value:
                bar(still, stretch.start_s, stretch.end_s, "zero-velocity update", theme.GOOD)
        mode = np.where(states["valid"] > 0.0, states["mode"], Mode.INITIALISING).astype(np.int64)
        for stretch in stretches(t_s, mode):
            kind = Mode(stretch.value)
            bar(replay.label, stretch.start_s, stretch.end_s, theme.MODE_NAMES[kind], theme.MODE_COLOURS[kind])
    figure.update_layout(barmode="overlay", hovermode="closest", margin_l=170)
    figure.update_yaxes(automargin=True)
    time_axis(figure, model.duration_s, 1)
    caption = "What the navigation solution rested on at each image, and when the filter took the aircraft to be still."
    return Panel("modes", "Mode and validity", caption, figure, 130 + 42 * 2 * len(model.replays))


def cpu(model: Model) -> Panel:
    """CPU time per image, stage by stage."""
    run = model.main.run
    t_s = model.flight.seconds(run.timing.t_ns)
    step = run.timing["step_us"]
    rows = worst_of_blocks(step, MAX_POINTS)
    figure = grid(1, 1)
    for stage, colour in zip(run.stages, theme.STAGE_COLOURS, strict=False):
        values = run.timing[stage + STAGE_SUFFIX][rows] / US_PER_MS
        if not np.any(values > 0.0):
            continue
        figure.add_scatter(
            x=t_s[rows],
            y=values,
            name=theme.stage_name(stage),
            mode="lines",
            stackgroup="stages",
            line={"width": 0.4, "color": colour},
            fillcolor=theme.faded(colour, 0.75),
            hovertemplate="%{y:.2f} ms",
        )
    top = float(np.quantile(step, 0.998)) / US_PER_MS
    figure.update_yaxes(title_text="CPU time [ms]", range=[0.0, 1.15 * top])
    time_axis(figure, model.duration_s, 1)
    thinning = "" if len(rows) == len(step) else " Of neighbouring images the slowest is drawn."
    period = float(np.median(np.diff(t_s))) * 1000.0 if len(t_s) > 1 else float("nan")
    caption = (
        f"{run.label}, CPU time of the flight thread for each image on this machine; a new image comes every "
        f"{period:.0f} ms.{thinning} Single peaks may leave the figure; the table below has the greatest."
    )
    return Panel("cpu", "CPU time per stage", caption, figure, 320)
