"""Figures of how wrong the estimates were: errors with bounds, scale, NEES. They need the truth."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from plumb_tools.report import theme
from plumb_tools.report.analysis import NEES_BOUNDS, SIGMAS, Errors, scale_window_s, sliding_scale
from plumb_tools.report.model import Judged, Model, Replay
from plumb_tools.report.panel import Panel, band, grid, line, time_axis
from plumb_tools.trajectory import FloatArray

ERROR_HEIGHT = 520
#: Bounds above this quantile may leave a figure of errors: the first moments would flatten all the rest.
BOUND_QUANTILE = 0.98
MIN_HALF_RANGE = 1e-6
Series = Callable[[Errors], tuple[FloatArray, FloatArray]]


def figures(model: Model) -> list[Panel]:
    """All figures of the errors; none without truth."""
    judged = [(replay, replay.judged) for replay in model.replays if replay.judged is not None]
    if not judged:
        return []
    start = "Aligned with the truth in position and heading at the first pose."
    return [
        _errors(
            model.duration_s,
            judged,
            "position",
            "Position error",
            "m",
            f"Estimate minus truth along the axes of the truth's world, z up. {start}",
            lambda e: (e.position_m, e.sigma_position_m),
        ),
        _errors(
            model.duration_s,
            judged,
            "velocity",
            "Velocity error",
            "m/s",
            "A velocity error along the flight that stays is a scale error: the position drifts in proportion.",
            lambda e: (e.velocity_m_s, e.sigma_velocity_m_s),
        ),
        _errors(
            model.duration_s,
            judged,
            "attitude",
            "Attitude error",
            "deg",
            "Rotation from the true to the estimated attitude about the world's axes: x and y are tilt, z is heading, "
            "which neither camera nor laser observes.",
            lambda e: (np.degrees(e.attitude_rad), np.degrees(e.sigma_attitude_rad)),
        ),
        _scale(model.duration_s, judged),
        _nees(model.duration_s, judged),
    ]


def _errors(
    duration_s: float,
    judged: list[tuple[Replay, Judged]],
    key: str,
    title: str,
    unit: str,
    explanation: str,
    series: Series,
) -> Panel:
    figure = grid(
        3,
        len(judged),
        shared_xaxes=True,
        vertical_spacing=0.05,
        horizontal_spacing=0.05,
        column_titles=[replay.label for replay, _ in judged],
    )
    for column, (replay, judgement) in enumerate(judged, start=1):
        errors, sigmas = series(judgement.errors)
        t_s = judgement.errors.t_s
        for axis, name in enumerate(theme.AXIS_NAMES):
            bound_name = f"{replay.label}, ±{SIGMAS:.0f}σ"
            place = {"row": axis + 1, "col": column}
            figure.add_traces(
                band(t_s, SIGMAS * sigmas[:, axis], bound_name, replay.colour, axis == 0),
                rows=[axis + 1] * 2,
                cols=[column] * 2,
            )
            curve = line(t_s, errors[:, axis], replay.label, replay.colour, showlegend=axis == 0)
            curve.hovertemplate = f"{name}: %{{y:.4g}} {unit}<extra></extra>"
            figure.add_trace(curve, **place)
            figure.update_yaxes(title_text=f"{name} [{unit}]", row=axis + 1, col=1)
    time_axis(figure, duration_s, 3)
    figure.update_layout(margin_t=52, legend_y=1.06)
    own, common = _ranges([series(judgement.errors) for _, judgement in judged])
    for name, limits in common.items():
        figure.layout[name].range = limits
    caption = f"{explanation} Bands: three standard deviations of the filter's own covariance."
    if len(judged) < 2:
        return Panel(key, title, caption, figure, ERROR_HEIGHT)
    return Panel(key, title, caption, figure, ERROR_HEIGHT, common=common, own=own)


def _ranges(series: list[tuple[FloatArray, FloatArray]]) -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    """Range of every y axis by name: each of its own, and one per row. Errors fit in, bounds but for rare peaks."""
    half = np.array(
        [
            [
                1.1 * max(np.abs(errors[:, axis]).max(), SIGMAS * np.quantile(sigmas[:, axis], BOUND_QUANTILE))
                for errors, sigmas in series
            ]
            for axis in range(3)
        ]
    )
    half = np.maximum(half, MIN_HALF_RANGE)
    own, common = {}, {}
    for number, (row, column) in enumerate(np.ndindex(half.shape), start=1):
        name = "yaxis" if number == 1 else f"yaxis{number}"
        own[name] = [-float(half[row, column]), float(half[row, column])]
        common[name] = [-float(half[row].max()), float(half[row].max())]
    return own, common


def _scale(duration_s: float, judged: list[tuple[Replay, Judged]]) -> Panel:
    figure = grid(1, 1)
    window_s = scale_window_s(duration_s)
    for replay, judgement in judged:
        percent = 100.0 * (sliding_scale(judgement.pairs, window_s) - 1.0)
        figure.add_trace(line(judgement.pairs.t_s, percent, replay.label, replay.colour, connectgaps=False))
    figure.add_hline(y=0.0, line={"color": theme.TRUTH, "width": 1.0})
    figure.update_yaxes(title_text="scale error [%]", hoverformat=".2f")
    time_axis(figure, duration_s, 1)
    caption = (
        f"Size of the estimated over size of the true path in a window of {window_s:.1f} s around each moment, minus "
        "one. A gap: the aircraft hardly moved. At constant velocity only the range observes scale."
    )
    return Panel("scale", "Scale error", caption, figure, 300)


def _nees(duration_s: float, judged: list[tuple[Replay, Judged]]) -> Panel:
    names = ("position", "velocity", "attitude")
    figure = grid(3, 1, shared_xaxes=True, vertical_spacing=0.05)
    lower, upper = NEES_BOUNDS
    for row, name in enumerate(names, start=1):
        for replay, judgement in judged:
            values = getattr(judgement.errors, f"nees_{name}")
            shown = np.where(values > 0.0, values, np.nan)  # zero by construction at the first pose
            curve = line(judgement.errors.t_s, shown, replay.label, replay.colour, showlegend=row == 1)
            curve.hovertemplate = f"{replay.label}: %{{y:.2f}}<extra></extra>"
            figure.add_trace(curve, row=row, col=1)
        figure.update_yaxes(type="log", title_text=name, dtick=1, range=[-2.0, 3.0], row=row, col=1)
        figure.add_hrect(y0=lower, y1=upper, fillcolor=theme.faded(theme.GOOD, 0.18), line_width=0, row=row, col=1)
    time_axis(figure, duration_s, 3)
    caption = (
        f"Normalised estimation error squared, three degrees of freedom, no unit. Green: {lower:.2f} to {upper:.2f}, "
        "where an honest covariance keeps it for 95 % of the time; above it the filter is too sure of itself."
    )
    return Panel("nees", "Consistency (NEES)", caption, figure, 460)
