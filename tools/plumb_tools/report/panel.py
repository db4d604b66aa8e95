"""What a figure of the report is, and how its plots begin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from plumb_tools.report import theme
from plumb_tools.report.analysis import thinned
from plumb_tools.trajectory import FloatArray

#: Points of a line: more are not to be told apart on a screen.
MAX_POINTS = 1500

LINE_WIDTH = 1.6
BOUND_OPACITY = 0.16


@dataclass(frozen=True)
class Panel:
    """One figure with its title and the line that explains it."""

    key: str  #: its anchor in the page
    title: str
    caption: str
    figure: go.Figure
    height_px: int
    over_time: bool = True  #: the x axes are time: a click moves the image viewer there
    common: dict[str, list[float]] | None = None  #: range of each y axis when replays side by side share it
    own: dict[str, list[float]] | None = None  #: and when each has its own
    wide: bool = True


def grid(rows: int, columns: int, **options: Any) -> go.Figure:
    """A figure of several plots with the margins of this report."""
    figure = make_subplots(rows=rows, cols=columns, **options)
    for annotation in figure.layout.annotations:
        annotation.font.size = 13
    return style(figure)


def style(figure: go.Figure) -> go.Figure:
    """Margins, legend and hover of every figure; its colours are those of the page and come in the browser."""
    figure.update_layout(
        margin={"l": 62, "r": 18, "t": 34, "b": 46},
        legend={"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom", "font": {"size": 12}},
        hovermode="x unified",
        hoverlabel={"namelength": -1},
        template="none",
    )
    return figure


def time_axis(figure: go.Figure, duration_s: float, last_row: int) -> None:
    """The same span of time on all x axes, named on the last row."""
    figure.update_xaxes(range=[0.0, duration_s], hoverformat=".2f")
    figure.update_xaxes(title_text="time since the first image [s]", row=last_row)


def line(t: FloatArray, values: FloatArray, name: str, colour: str, **options: Any) -> go.Scatter:
    """A line of at most MAX_POINTS points."""
    keep = thinned(len(t), MAX_POINTS)
    dash = options.pop("dash", None)
    width = options.pop("width", LINE_WIDTH)
    return go.Scatter(
        x=t[keep],
        y=values[keep],
        name=name,
        mode="lines",
        line={"color": colour, "width": width, "dash": dash},
        **options,
    )


def band(t: FloatArray, half_width: FloatArray, name: str, colour: str, show: bool) -> list[go.Scatter]:
    """A band around zero."""
    keep = thinned(len(t), MAX_POINTS)
    edge = {"color": theme.faded(colour, 2.5 * BOUND_OPACITY), "width": 0.8}
    shared: dict[str, Any] = {"x": t[keep], "mode": "lines", "line": edge, "legendgroup": name, "hoverinfo": "skip"}
    return [
        go.Scatter(y=half_width[keep], showlegend=False, **shared),
        go.Scatter(
            y=-half_width[keep],
            name=name,
            showlegend=show,
            fill="tonexty",
            fillcolor=theme.faded(colour, BOUND_OPACITY),
            **shared,
        ),
    ]
