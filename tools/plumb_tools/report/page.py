"""The page: figures, images and tables put into the HTML template. Everything is inside; it opens without a network."""

from __future__ import annotations

import json
from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import plotly.io
from plotly.offline import get_plotlyjs

from plumb_tools.report import figures_error, figures_filter, figures_path, sections, theme
from plumb_tools.report.events import events_of
from plumb_tools.report.model import Model, ground_of
from plumb_tools.report.overlay import View, jpeg_uri
from plumb_tools.report.panel import Panel
from plumb_tools.report.run import Mode, RangeOutcome
from plumb_tools.trajectory import FloatArray

ASSETS = Path(__file__).parent / "assets"
IMAGE_WIDTH_PX = 720

Progress = Callable[[str], None]


def render(model: Model, views: list[View], progress: Progress) -> str:
    """The whole page as text."""
    progress("drawing the figures")
    panels = _panels(model)
    progress(f"packing {len(views)} images")
    viewer = _viewer(model, views)
    fields = {
        "title": escape(model.flight.name),
        "style": _asset("page.css"),
        "summary": sections.summary_line(model),
        "cards": sections.cards(model),
        "path": "".join(map(_figure, panels["path"])),
        "range": "".join(map(_figure, panels["range"])),
        "errors": "".join(map(_figure, panels["errors"])) or "<p class='caption'>This flight has no truth.</p>",
        "filter": "".join(map(_figure, panels["filter"])),
        "scores": sections.score_table(model),
        "stages": sections.stage_table(model.main.run),
        "events": sections.event_table(events_of(model.flight, model.main.run)),
        "counters": sections.counter_table(model),
        "parameters": sections.parameter_table(model.main.run),
        "plotly": get_plotlyjs(),
        "data": _script_json(_data(panels["all"], viewer)),
        "script": _asset("viewer.js") + _asset("page.js"),
    }
    return _fill(_asset("page.html"), fields)


def _asset(name: str) -> str:
    return (ASSETS / name).read_text(encoding="utf-8")


def _fill(template: str, fields: dict[str, str]) -> str:
    """The template with its {{names}} replaced; in one pass, so that nothing inside a field is taken for a name."""
    parts = template.split("{{")
    filled = [parts[0]]
    for part in parts[1:]:
        name, rest = part.split("}}", 1)
        filled += [fields[name], rest]
    return "".join(filled)


def _panels(model: Model) -> dict[str, list[Panel]]:
    ground = ground_of(model)
    profile = figures_filter.range_profile(model)
    panels = {
        "path": figures_path.figures(model, ground),
        "range": [] if profile is None else [profile],
        "errors": figures_error.figures(model),
        "filter": [figures_filter.modes(model), figures_filter.features(model), figures_filter.cpu(model)],
    }
    return {**panels, "all": [panel for group in panels.values() for panel in group]}


def _figure(panel: Panel) -> str:
    release = "<button type='button' class='release'>own scales</button>" if panel.own is not None else ""
    return (
        f"<figure id='{panel.key}' class='{'wide' if panel.wide else 'half'}'>"
        f"<h3>{escape(panel.title)}{release}</h3>"
        f"<div class='plot' data-key='{panel.key}' style='height:{panel.height_px}px'></div>"
        f"<figcaption>{escape(panel.caption)}</figcaption></figure>"
    )


def _data(panels: list[Panel], viewer: dict[str, Any]) -> dict[str, Any]:
    figures = {
        panel.key: {
            **json.loads(plotly.io.to_json(panel.figure, validate=False)),
            "overTime": panel.over_time,
            "common": panel.common,
            "own": panel.own,
        }
        for panel in panels
    }
    return {"figures": figures, "viewer": viewer}


def _script_json(tree: dict[str, Any]) -> str:
    """JSON that may stand inside a script element."""
    return json.dumps(tree, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")


def _viewer(model: Model, views: list[View]) -> dict[str, Any]:
    camera = model.flight.camera
    return {
        "width": camera.width,
        "height": camera.height,
        "hasFeatures": model.main.run.features_file is not None,
        "first": _telling(model, views),
        "frames": [_frame(model, view) for view in views],
    }


def _telling(model: Model, views: list[View]) -> int:
    """The image to open with: one from the second half of the flight whose range was compared with a facet."""
    outcomes = model.main.run.states["range_outcome"]
    middle = len(views) // 2
    used = (
        index
        for index, view in enumerate(views)
        if index >= middle and view.ranged_px is not None and outcomes[view.row] == RangeOutcome.USED
    )
    return next(used, middle)


def _frame(model: Model, view: View) -> dict[str, Any]:
    states = model.main.run.states
    valid = bool(states["valid"][view.row])
    outcome = RangeOutcome(int(states["range_outcome"][view.row]))
    predicted = float(states["range_predicted_m"][view.row])
    t_s, path_m = model.reference_path
    here = [float(np.interp(view.t_s, t_s, path_m[:, axis])) for axis in range(2)]
    return {
        "t": round(view.t_s, 4),
        "image": jpeg_uri(view.file, IMAGE_WIDTH_PX),
        "slam": _flat(view.slam_px),
        "tracks": _flat(view.tracks_px),
        "tails": [_flat(tail) for tail in view.tails_px],
        "facets": [_flat(facet) for facet in view.facets_px],
        "ranged": None if view.ranged_px is None else _flat(view.ranged_px),
        "beam": None if view.beam_px is None else _flat(view.beam_px),
        "mode": theme.MODE_NAMES[Mode(int(states["mode"][view.row])) if valid else Mode.INITIALISING],
        "outcome": theme.OUTCOME_NAMES[outcome],
        "gated": outcome == RangeOutcome.GATED,
        "measured": _metres(float(states["range_measured_m"][view.row]), outcome != RangeOutcome.NONE),
        "predicted": _metres(predicted, outcome in (RangeOutcome.USED, RangeOutcome.GATED)),
        "position": [round(value, 3) for value in here],
    }


def _metres(value: float, known: bool) -> float | None:
    return round(value, 3) if known and value > 0.0 else None


def _flat(points: FloatArray) -> list[float]:
    """Coordinates one after the other, to a tenth of a pixel."""
    return [round(float(value), 1) for value in np.ravel(points)]
