"""Figures of where the flight went: in space, from above, and along the path with the ground under the laser."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from plumb_tools.report import theme
from plumb_tools.report.analysis import thinned
from plumb_tools.report.model import Ground, Model, travelled
from plumb_tools.report.panel import MAX_POINTS, Panel, line, style
from plumb_tools.report.run import AIDING, RangeOutcome
from plumb_tools.trajectory import FloatArray

#: A box in space is drawn no flatter than this: a straight flight would have no width to look at.
MIN_BOX_SIDE = 0.3
#: Diagonal of the box, in the units of the camera's distance: long boxes fill as much of the figure as cubes do.
BOX_DIAGONAL = 1.7
#: Beyond this ratio of length to width the view from above is stretched.
MAX_PLAN_RATIO = 8.0
GROUND_POINTS = 1200


def figures(model: Model, ground: Ground | None) -> list[Panel]:
    """All figures of the path."""
    panels = [_space(model, ground), _plan(model)]
    return panels if ground is None else [*panels, _profile(model, ground)]


def _lines(model: Model) -> list[tuple[FloatArray, str, str, float, str | None]]:
    """Paths with name, colour, width and dash; the truth first, so that the estimates lie over it."""
    found: list[tuple[FloatArray, str, str, float, str | None]] = []
    if model.main.judged is not None:
        found.append((model.main.judged.pairs.truth_p_m, "truth", theme.TRUTH, 5.0, None))
    for replay in reversed(model.replays):
        found.append((replay.path_m, replay.label, replay.colour, 2.0, None))
    return found


def _alignment_note(model: Model) -> str:
    if model.main.judged is None:
        return "There is no truth in this flight."
    return "Estimates are aligned with the truth in position and heading at their first pose only."


def _box(points: FloatArray) -> tuple[dict[str, float], bool]:
    """Aspect ratio of a box around points (N, 3), and whether it is true to scale."""
    sides = np.ptp(points, axis=0)
    relative = sides / max(float(sides.max()), 1e-9)
    drawn = np.maximum(relative, MIN_BOX_SIDE)
    box = drawn * BOX_DIAGONAL / np.linalg.norm(drawn)
    return dict(zip("xyz", box.tolist(), strict=True)), bool(np.allclose(relative, drawn))


def _space(model: Model, ground: Ground | None) -> Panel:
    figure = style(go.Figure())
    everything = [path for path, *_ in _lines(model)]
    if ground is not None:
        accepted = np.flatnonzero(np.isin(ground.outcome, AIDING))
        keep = accepted[thinned(len(accepted), GROUND_POINTS)]
        points = ground.point_m[keep]
        everything.append(points)
        figure.add_scatter3d(
            x=points[:, 0],
            y=points[:, 1],
            z=points[:, 2],
            mode="markers",
            marker={"size": 1.8, "color": theme.GOOD, "opacity": 0.7},
            name="ground under the laser",
            hoverinfo="skip",
        )
    for path, name, colour, width, _ in _lines(model):
        keep = thinned(len(path), MAX_POINTS)
        x, y, z = path[keep].T
        options = {"color": colour, "width": 1.6 * width}
        figure.add_scatter3d(x=x, y=y, z=z, mode="lines", line=options, opacity=0.9, name=name)
    aspect, true_to_scale = _box(np.concatenate(everything))
    axes = {f"{axis}axis": {"title": {"text": f"{axis} [m]"}} for axis in "xyz"}
    camera = {"eye": {"x": -1.2, "y": -1.7, "z": 0.95}, "center": {"x": 0.0, "y": 0.0, "z": -0.12}}
    figure.update_layout(
        scene={**axes, "aspectmode": "manual", "aspectratio": aspect, "camera": camera},
        margin={"l": 0, "r": 0, "t": 30, "b": 0},
        hovermode="closest",
    )
    scale = "" if true_to_scale else " Narrow sides of the box are widened."
    caption = f"Drag to turn, scroll to zoom. {_alignment_note(model)}{scale}"
    return Panel("space", "Trajectory in space", caption, figure, 460, over_time=False, wide=False)


def _plan(model: Model) -> Panel:
    figure = style(go.Figure())
    for path, name, colour, width, dash in _lines(model):
        figure.add_trace(line(path[:, 0], path[:, 1], name, colour, width=width, dash=dash))
    start, end = model.reference_path[1][0], model.reference_path[1][-1]
    for point, symbol, name in ((start, "circle", "start"), (end, "square", "end")):
        marker = {"size": 11, "symbol": symbol, "color": theme.GOOD, "line": {"width": 1.5, "color": "white"}}
        figure.add_scatter(x=point[:1], y=point[1:2], mode="markers", marker=marker, name=name)
    plan = np.concatenate([path[:, :2] for path, *_ in _lines(model)])
    sides = np.ptp(plan, axis=0)
    to_scale = float(sides.max()) <= MAX_PLAN_RATIO * max(float(sides.min()), 1e-9)
    if to_scale:
        figure.update_yaxes(scaleanchor="x", scaleratio=1.0)
    figure.update_xaxes(title_text="x [m]")
    figure.update_yaxes(title_text="y [m]")
    figure.update_layout(hovermode="closest")
    scale = "True to scale." if to_scale else "Across the path the scale is stretched."
    caption = f"{scale} The marker follows the image viewer."
    return Panel("plan", "Trajectory from above", caption, figure, 460, over_time=False, wide=False)


def _profile(model: Model, ground: Ground) -> Panel:
    figure = style(go.Figure())
    shown = (
        (RangeOutcome.SPARE, "ground: spare"),
        (RangeOutcome.USED, "ground: accepted"),
        (RangeOutcome.FEATURE, "ground: given to a feature"),
        (RangeOutcome.NO_FACET, "ground: no facet"),
        (RangeOutcome.BAD_GEOMETRY, "ground: bad geometry"),
        (RangeOutcome.GATED, "ground: gated"),
    )
    for outcome, name in shown:
        rows = np.flatnonzero(ground.outcome == outcome)
        if not rows.size:
            continue
        keep = rows[thinned(len(rows), GROUND_POINTS)]
        gated = outcome == RangeOutcome.GATED
        marker = {"size": 7 if gated else 3.5, "symbol": theme.OUTCOME_SYMBOLS.get(outcome, "circle")}
        colour = theme.GOOD if outcome == RangeOutcome.USED else theme.OUTCOME_COLOURS[outcome]
        figure.add_scatter(
            x=ground.distance_m[keep],
            y=ground.point_m[keep, 2],
            mode="markers",
            marker={**marker, "color": colour},
            name=name,
        )
    distance = travelled(model.reference_path[1])
    reference_t_s = model.reference_path[0]
    for path, name, colour, width, dash in _lines(model):
        times = next((replay.t_s for replay in model.replays if replay.path_m is path), reference_t_s)
        along = np.interp(times, reference_t_s, distance)
        figure.add_trace(line(along, path[:, 2], name, colour, width=width, dash=dash))
    figure.update_xaxes(title_text="distance travelled [m]")
    figure.update_yaxes(title_text="z, up [m]")
    poses = "estimated" if model.main.judged is None else "true"
    caption = f"Height of the aircraft and of the surface that the laser met, placed by the {poses} poses."
    return Panel("profile", "Height profile along the path", caption, figure, 320, over_time=False)
