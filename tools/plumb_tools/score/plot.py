"""Picture of a score: position error per axis, and the path seen from above."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plumb_tools.score.align import Alignment
from plumb_tools.score.compute import Scored
from plumb_tools.score.errors import position_errors
from plumb_tools.score.pairs import Pairs
from plumb_tools.score.table import COLUMN_TITLES
from plumb_tools.trajectory import FloatArray

TRUTH_COLOUR = "#3a3f47"
START_COLOUR = "#d1752c"
ALIGNED_COLOUR = "#1f6fb4"
BOUND_COLOUR = "#f3dcc4"
GRID_COLOUR = "#e4e6ea"
TEXT_COLOUR = "#22252a"

SIGMAS = 3.0
GAP_S = 0.5  #: lines are broken where the estimate pauses for longer
STYLE: dict[Any, Any] = {
    "font.size": 10.5,
    "axes.edgecolor": "#9aa0a8",
    "axes.labelcolor": TEXT_COLOUR,
    "axes.titlesize": 11.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID_COLOUR,
    "text.color": TEXT_COLOUR,
    "xtick.color": "#5b616a",
    "ytick.color": "#5b616a",
    "legend.frameon": False,
}


def save(scored: Scored, path: Path) -> None:
    """Draws the score into a file of the kind its suffix names."""
    with plt.rc_context(STYLE):
        figure = _draw(scored)
        try:
            figure.savefig(path, dpi=150)
        finally:
            plt.close(figure)


def _draw(scored: Scored) -> Figure:
    pairs, figures = scored.pairs, scored.score
    start = scored.alignments["start"]
    selected = scored.alignments[figures.selected]
    selected_errors = figures.alignments[figures.selected]
    assert start is not None  # the start alignment always exists

    figure = plt.figure(figsize=(13.5, 7.2), layout="constrained")
    grid = figure.add_gridspec(3, 2, width_ratios=[1.25, 1.0])
    axes = [figure.add_subplot(grid[0, 0])]
    axes += [figure.add_subplot(grid[row, 0], sharex=axes[0]) for row in (1, 2)]
    _draw_errors(axes, pairs, start, selected, COLUMN_TITLES[figures.selected])
    _draw_path(figure.add_subplot(grid[:, 1]), pairs, selected or start)

    title = f"{Path(figures.estimate).name}:  coverage {100.0 * figures.coverage.covered:.1f} %"
    if selected_errors is not None:
        title += f",  ATE {selected_errors.ate_rmse_m:.3f} m ({COLUMN_TITLES[figures.selected]})"
    title += f",  {figures.distance_m:.1f} m travelled"
    figure.suptitle(title, x=0.01, ha="left", fontsize=13.5, fontweight="bold")
    return figure


def _broken(t_s: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A line with a gap wherever the time does not go on within GAP_S."""
    gaps = np.flatnonzero(np.diff(t_s) > GAP_S) + 1
    return np.insert(t_s, gaps, np.nan), np.insert(values, gaps, np.nan, axis=0)


def _sigmas(pairs: Pairs, start: Alignment) -> FloatArray | None:
    """Standard deviation of the position per axis of the truth's frame, (N, 3)."""
    if pairs.covariances is None:
        return None
    rotation = start.rotation.as_matrix()
    turned = rotation @ pairs.covariances.position @ rotation.T
    return np.asarray(np.sqrt(np.maximum(np.diagonal(turned, axis1=1, axis2=2), 0.0)))


def _draw_errors(axes: list[Axes], pairs: Pairs, start: Alignment, selected: Alignment | None, title: str) -> None:
    sigmas = _sigmas(pairs, start)
    start_error = 100.0 * position_errors(pairs, start)
    aligned_error = None if selected is None else 100.0 * position_errors(pairs, selected)
    for index, (axis, name) in enumerate(zip(axes, ("x", "y", "z"), strict=True)):
        if sigmas is not None:
            bound = 100.0 * SIGMAS * sigmas[:, index]
            t_s, band = _broken(pairs.t_s, bound)
            axis.fill_between(t_s, -band, band, color=BOUND_COLOUR, lw=0, label=f"{SIGMAS:.0f} sigma of the filter")
        axis.axhline(0.0, color="#9aa0a8", lw=0.8)
        axis.plot(*_broken(pairs.t_s, start_error[:, index]), color=START_COLOUR, lw=1.4, label="aligned at the start")
        if aligned_error is not None:
            line = _broken(pairs.t_s, aligned_error[:, index])
            axis.plot(*line, color=ALIGNED_COLOUR, lw=1.4, label=f"aligned over the run, {title}")
        axis.set_ylabel(f"{name} error [cm]")
        axis.margins(x=0.01)
        if index < 2:
            axis.tick_params(labelbottom=False)
    axes[0].set_title("Position error, axes of the truth", pad=26)
    axes[0].legend(loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=3, borderaxespad=0.2, handlelength=1.6)
    axes[2].set_xlabel("time since the start of the span [s]")


def _draw_path(axis: Axes, pairs: Pairs, alignment: Alignment) -> None:
    est = alignment.positions(pairs.est_p_m)
    axis.plot(*_broken(pairs.t_s, pairs.truth_p_m)[1][:, :2].T, color=TRUTH_COLOUR, lw=3.2, alpha=0.35, label="truth")
    label = f"estimate, {COLUMN_TITLES[alignment.name]}"
    axis.plot(*_broken(pairs.t_s, est)[1][:, :2].T, color=ALIGNED_COLOUR, lw=1.3, label=label)
    ends: dict[str, Any] = {"fillstyle": "full", "ls": "none", "ms": 8, "zorder": 5, "mec": "white", "mew": 1.2}
    axis.plot(*est[0, :2], marker="o", color="#2b8a57", label="start", **ends)
    axis.plot(*est[-1, :2], marker="s", color="#b3362f", label="end", **ends)
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_title("Path from above", pad=26)
    axis.set_xlabel("x [m]")
    axis.set_ylabel("y [m]")
    axis.legend(loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=4, borderaxespad=0.2, handlelength=1.6)
