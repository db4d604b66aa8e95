"""The page of results: what the suite flew, as Markdown."""

from __future__ import annotations

import platform
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from plumb_tools.demo.pipeline import ROOT, Scene
from plumb_tools.demo.results import (
    COLUMNS,
    NONE,
    RANGE_VIO,
    Column,
    Figures,
    Outcome,
    error_ratio,
    mean_and_worst,
)

INTRODUCTION = """\
# Results

Scenes of `tools/scenes`, each simulated with one or more seeds: the same scene with other noise, biases, clocks and
gusts. Each flight is flown twice by the same flight software with the same settings; VIO only leaves the range finder
out. The images are rendered, and the whole front end works on them.

Errors per axis are those after alignment in position and heading at the first pose, in percent of the distance
travelled; ATE is the root mean square position error after alignment in position and heading over the flight. NEES is
the mean over a flight, ideally 3. Entries are the mean over the seeds and, in brackets, the worst; of signed figures
the size counts. The scale error after 10 s is that of the displacement from 10 to 12 s after the first state, where there
is one of a metre; the first state comes so long after the first image, and coverage is the share of the flight with a
state. CPU time is that of one image, front end included; the real-time factor is by the clock on the wall, with
reading of files, and falls with whatever else the machine does."""

LINE_WIDTH = 120

#: Those of the terminal, and how a flight began.
PAGE_COLUMNS = (
    *COLUMNS[:4],
    Column("scale error after 10 s", "", "%", lambda f: f.headline.early_scale_error_percent, 2, signed=True),
    *COLUMNS[4:],
    Column("first state", "", "s", lambda f: f.headline.first_state_s, 2),
    Column("coverage", "", "%", lambda f: f.headline.coverage_percent, 1, least_is_worst=True),
)



@dataclass(frozen=True)
class Target:
    """What range-VIO has to keep in each flight of a scene."""

    text: str  # with a place for the limit
    limit: float
    value: Callable[[Figures], float | None]  # of signed figures the size counts

    def kept_by(self, outcome: Outcome) -> bool:
        value = None if outcome.range_vio is None else self.value(outcome.range_vio)
        return value is not None and abs(value) <= self.limit


def _axis(percent: float) -> Target:
    text = "range-VIO within {:g} % of the distance on each axis"
    return Target(text, percent, lambda f: f.headline.max_axis_percent)


def _scale(percent: float) -> Target:
    return Target("scale error at most {:g} %", percent, lambda f: f.headline.scale_error_percent)


#: By scene.
TARGETS = {
    "outdoor": (_axis(0.4), _scale(0.2)),
    "cruise": (
        Target("first state within {:g} s", 1.0, lambda f: f.headline.first_state_s),
        Target("scale error after 10 s at most {:g} %", 2.0, lambda f: f.headline.early_scale_error_percent),
        _scale(0.5),
        _axis(0.6),
    ),
    "indoor": (_axis(0.2),),
    "excitation": (_axis(0.02),),
    "hover": (Target("range-VIO within {:g} m on each axis", 0.02, lambda f: f.headline.max_axis_m),),
    "mars": (_axis(0.4),),
}
#: Where VIO is at its best, the greatest error of range-VIO over that of VIO.
RATIO_TARGETS = {"excitation": 1.1}


@dataclass(frozen=True)
class SceneResults:
    """All flights of one scene."""

    scene: Scene
    outcomes: list[Outcome]


def _entry(figures: Sequence[Figures], column: Column) -> str:
    both = mean_and_worst(figures, column)
    if both is None:
        return NONE
    mean, worst = both
    if len(figures) == 1:
        return f"{mean:.{column.digits}f}"
    return f"{mean:.{column.digits}f} ({worst:.{column.digits}f})"


def _markdown_table(results: Sequence[SceneResults]) -> list[str]:
    head = ["scene", "flown as", "flights", *(f"{column.title} [{column.unit}]" for column in PAGE_COLUMNS)]
    lines = ["| " + " | ".join(head) + " |", "|---|---|---:|" + "---:|" * len(PAGE_COLUMNS)]
    for result in results:
        for index, name in enumerate(name for name, _ in result.outcomes[0].replays()):
            figures = [found for outcome in result.outcomes if (found := outcome.replays()[index][1]) is not None]
            flown = len(result.outcomes)
            count = str(flown) if len(figures) == flown else f"{len(figures)} of {flown}"
            shown = f"**{name}**" if name == RANGE_VIO else name
            cells = [result.scene.name if index == 0 else "", shown, count, *(_entry(figures, c) for c in PAGE_COLUMNS)]
            lines.append("| " + " | ".join(cells) + " |")
    return lines


def _kept(result: SceneResults) -> list[str]:
    """Whether the flights of a scene keep its targets, a sentence each."""
    sentences = []
    name, flown = result.scene.name, len(result.outcomes)
    for target in TARGETS.get(name, ()):
        kept = sum(target.kept_by(outcome) for outcome in result.outcomes)
        sentences.append(f"Target: {target.text.format(target.limit)}; kept in {kept} of {flown} flights.")
    if name in RATIO_TARGETS:
        limit = RATIO_TARGETS[name]
        kept = sum((ratio := error_ratio([o])) is not None and limit * ratio >= 1.0 for o in result.outcomes)
        sentences.append(
            f"Target: the greatest error of range-VIO at most {100.0 * (limit - 1.0):.0f} % above that of VIO; "
            f"kept in {kept} of {flown} flights."
        )
    return sentences


def _scene_text(result: SceneResults) -> list[str]:
    scored = [figures for outcome in result.outcomes if (figures := outcome.range_vio or outcome.vio) is not None]
    length = f", {scored[0].headline.distance_m:.0f} m" if scored else ""
    summary = result.scene.summary.rstrip(".") or "no summary in the scene file"
    text = f"{summary[0].upper()}{summary[1:]}. {result.scene.shows}".strip()
    lines = [f"### {result.scene.name}{length}", "", *textwrap.wrap(text, LINE_WIDTH)]
    sentences = _kept(result)
    if (ratio := error_ratio(result.outcomes)) is not None:
        sentences.append(f"The greatest error of VIO is {ratio:.1f} times that of range-VIO.")
    if sentences:
        lines += ["", *textwrap.wrap(" ".join(sentences), LINE_WIDTH)]
    alike: dict[tuple[str, str], list[str]] = {}
    for outcome in result.outcomes:
        for name, why in outcome.reasons.items():
            alike.setdefault((name, _one_line(why)), []).append(str(outcome.seed))
    for (name, why), seeds in alike.items():
        flights = f"Seed{'s' if len(seeds) > 1 else ''} {', '.join(seeds)}"
        lines += ["", *textwrap.wrap(f"{flights}, {name}: {why}.", LINE_WIDTH)]
    return [*lines, ""]


def _one_line(text: str) -> str:
    """The first line of a message, without folders of this machine."""
    return text.splitlines()[0].replace(f"{ROOT}/", "")


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text(encoding="utf-8").splitlines() if cpuinfo.exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.machine()


def markdown(results: Sequence[SceneResults], command: str) -> str:
    """The page of results."""
    lines = [INTRODUCTION, "", *_markdown_table(results), "", "## What each scene shows", ""]
    for result in results:
        lines += _scene_text(result)
    lines += ["## How this page is made", "", f"    {command}", ""]
    lines.append(f"CPU times and real-time factors are from {_processor()}, two flights at a time.")
    return "\n".join(lines) + "\n"


