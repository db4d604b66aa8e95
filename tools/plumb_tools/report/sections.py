"""The parts of the page that are text: headline, tables, configuration. All return HTML."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from plumb_tools.report import theme
from plumb_tools.report.events import Event
from plumb_tools.report.headline import US_PER_MS, Cost, Headline
from plumb_tools.report.model import Model
from plumb_tools.report.run import STAGE_SUFFIX, Run, absence

NONE = "&ndash;"
#: Events shown before the rest is folded away.
OPEN_EVENTS = 12
CENTIMETRES_BELOW = 0.1
#: Two figures whose ratio is smaller are called alike.
EQUAL_BELOW = 1.05


def numbers(values: Sequence[float | None], digits: int = 3, unit: str = "") -> list[str]:
    """Numbers with significant digits, all in the same unit; small lengths and speeds in centimetres."""
    known = [abs(value) for value in values if value is not None and np.isfinite(value)]
    if unit in ("m", "m/s") and known and max(known) < CENTIMETRES_BELOW:
        return [_number(None if value is None else 100.0 * value, digits, "c" + unit) for value in values]
    return [_number(value, digits, unit) for value in values]


def _number(value: float | None, digits: int, unit: str) -> str:
    if value is None or not np.isfinite(value):
        return NONE
    # No more decimals than digits: 0.0184 % is as good as 0.018 %, and a small one needs no exponent.
    text = f"{value:.{digits}g}" if abs(value) >= 1.0 else f"{value:.{digits}f}"
    if "e" in text:
        text = f"{value:.0f}"
    return text.replace("-", "&minus;") + (f"<span class='unit'>&thinsp;{unit}</span>" if unit else "")


def summary_line(model: Model) -> str:
    """What was flown, in one line, and a line for each replay that gave nothing to show."""
    main = model.main
    facts = [f"{model.duration_s:.1f} s", f"{len(model.flight.t_images_ns)} images"]
    if main.judged is not None:
        facts.insert(0, f"{main.judged.headline.distance_m:.1f} m")
    camera = model.flight.camera
    facts.append(f"{camera.width} &times; {camera.height} px")
    if model.flight.range_finder is not None:
        facts.append(f"{np.count_nonzero(model.flight.range_finder.range_m > 0.0)} ranges")
    facts.append(f"configuration <b>{escape(str(main.run.summary['configuration']))}</b>")
    facts.append(f"run hash <code>{escape(str(main.run.summary['run_hash']))}</code>")
    missing = [f"<br><b>{escape(name)}</b>: {escape(reason)}" for name, reason in model.absent.items()]
    return " &middot; ".join(facts) + "".join(missing)


def cards(model: Model) -> str:
    """The headline figures, replays side by side."""
    judged = [replay.judged.headline for replay in model.replays if replay.judged is not None]
    parts: list[str] = []
    if judged:
        parts = [
            _card(model, "Worst axis", "greatest position error", [h.max_axis_percent for h in judged], "%", True),
            _card(model, "Trajectory (ATE)", "position error, RMS", [h.ate_m for h in judged], "m", True),
            _card(model, "Scale", "error of the whole path", [h.scale_error_percent for h in judged], "%", False),
            _card(model, "Velocity", "error, RMS", [h.velocity_rmse_m_s for h in judged], "m/s", True),
            _card(model, "Consistency", "NEES of position, ideal 3", [h.nees_position for h in judged], "", False),
        ]
    costs = [replay.cost for replay in model.replays]
    parts.append(_card(model, "CPU time", "per image, mean", [cost.cpu_ms for cost in costs], "ms", False))
    return "\n".join(parts)


def _card(model: Model, title: str, note: str, values: Sequence[float | None], unit: str, compare: bool) -> str:
    rows = [
        _value(replay.label, replay.colour, text)
        for replay, text in zip(model.replays, numbers(values, 3, unit), strict=True)
    ]
    rows += [_value(name, theme.colour_of(name), absence(reason), "none") for name, reason in model.absent.items()]
    ratio = _ratio(values) if compare else ""
    return f"<div class='card'><h3>{title}</h3><p>{note}</p>{''.join(rows)}{ratio}</div>"


def _value(label: str, colour: str, text: str, kind: str = "") -> str:
    return f"<div class='value {kind}' style='--colour:{colour}'><b>{text}</b><span>{escape(label)}</span></div>"


def _ratio(values: Sequence[float | None]) -> str:
    """How the second value compares with the first, by size."""
    if len(values) < 2 or not values[0] or not values[1]:
        return ""
    factor = abs(values[1]) / abs(values[0])
    if max(factor, 1.0 / factor) < EQUAL_BELOW:
        return "<p>like VIO</p>"
    if factor > 1.0:
        return f"<p class='better'>{_number(factor, 2, '')} &times; better than VIO</p>"
    return f"<p>{_number(1.0 / factor, 2, '')} &times; worse than VIO</p>"


def table(head: Sequence[str], rows: Sequence[Sequence[str]], kind: str = "") -> str:
    """An HTML table; cells are HTML already."""
    top = "".join(f"<th>{cell}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table class='{kind}'><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def score_table(model: Model) -> str:
    """Every figure of the headline for both replays."""
    headlines = [replay.judged.headline for replay in model.replays if replay.judged is not None]
    costs = [replay.cost for replay in model.replays]
    rows = [[name, *cells] for name, cells in (*_headline_rows(headlines), *_cost_rows(costs))]
    return table(["", *(escape(replay.label) for replay in model.replays)], rows, "numbers")


def _headline_rows(headlines: list[Headline]) -> list[tuple[str, list[str]]]:
    if not headlines:
        return []
    return [
        ("greatest error on an axis", numbers([h.max_axis_m for h in headlines], 3, "m")),
        ("the same of the distance", numbers([h.max_axis_percent for h in headlines], 3, "%")),
        ("ATE, aligned in position and heading", numbers([h.ate_m for h in headlines], 3, "m")),
        ("scale error", numbers([h.scale_error_percent for h in headlines], 3, "%")),
        ("velocity error, root mean square", numbers([h.velocity_rmse_m_s for h in headlines], 3, "m/s")),
        ("NEES of position (ideal 3)", numbers([h.nees_position for h in headlines])),
        ("NEES of velocity (ideal 3)", numbers([h.nees_velocity for h in headlines])),
        ("NEES of attitude (ideal 3)", numbers([h.nees_attitude for h in headlines])),
        ("coverage of the flight", numbers([h.coverage_percent for h in headlines], 4, "%")),
        ("re-initialisations", [str(h.resets) for h in headlines]),
    ]


def _cost_rows(costs: list[Cost]) -> list[tuple[str, list[str]]]:
    return [
        ("CPU time per image, mean", numbers([c.cpu_ms for c in costs], 3, "ms")),
        ("CPU time per image, 95 %", numbers([c.cpu_p95_ms for c in costs], 3, "ms")),
        ("real-time factor of the replay", numbers([c.realtime_factor for c in costs], 3, "&times;")),
    ]


def stage_table(run: Run) -> str:
    """CPU time of each stage over the replay."""
    rows = []
    for stage in (*run.stages, "step"):
        values = run.timing[stage + STAGE_SUFFIX] / US_PER_MS
        if not np.any(values > 0.0):
            continue
        name = "whole step" if stage == "step" else theme.stage_name(stage)
        figures = (values.mean(), *np.quantile(values, [0.5, 0.95]), values.max())
        rows.append([name, *(f"{figure:.3f}" for figure in figures)])
    return table(["stage", "mean [ms]", "median", "95 %", "greatest"], rows, "numbers")


def event_table(events: list[Event]) -> str:
    """Events in order; a click on one moves the image viewer there."""
    if not events:
        return "<p class='caption'>Nothing to tell.</p>"
    cells = [
        [
            f"<a href='#viewer' data-time='{event.t_s:.3f}'>{event.t_s:.2f} s</a>",
            f"<i class='{event.kind}'></i>{escape(event.text)}",
        ]
        for event in events
    ]
    shown = table(["time", "event"], cells[:OPEN_EVENTS], "events")
    if len(cells) <= OPEN_EVENTS:
        return shown
    rest = table(["time", "event"], cells[OPEN_EVENTS:], "events")
    return f"{shown}<details><summary>{len(cells) - OPEN_EVENTS} more</summary>{rest}</details>"


def counter_table(model: Model) -> str:
    """The counters of all parts of the flight software, replays side by side."""
    runs = [replay.run for replay in model.replays]
    counters = [run.summary["counters"] for run in runs]
    rows = []
    for part, names in counters[0].items():
        for name in names:
            values = [str(counter.get(part, {}).get(name, NONE)) for counter in counters]
            rows.append([f"{escape(part)} &middot; {escape(name.replace('_', ' '))}", *values])
    return table(["counter", *(escape(run.label) for run in runs)], rows, "numbers")


def parameter_table(run: Run) -> str:
    """The parameters in force."""
    parameters = run.summary.get("parameters", {})
    rows = [[f"<code>{escape(str(name))}</code>", f"{value:g}"] for name, value in parameters.items()]
    return table(["parameter", "value"], rows, "numbers")
