"""`tools/score --suite`: every scene with several seeds, flown with and without range, as a table in Markdown."""

from __future__ import annotations

import argparse
import platform
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from plumb_tools.demo import pipeline
from plumb_tools.demo.pipeline import ROOT, Folders, Scene
from plumb_tools.demo.process import StepFailed, Steps
from plumb_tools.demo.results import (
    COLUMNS,
    NONE,
    RANGE_VIO,
    Column,
    Figures,
    Outcome,
    error_ratio,
    mean_and_worst,
    terminal_table,
)
from plumb_tools.trajectory import InputError

EXIT_FAILED = 1
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130

DEFAULT_SEEDS = 5
DEFAULT_OUT = Path("docs/results.md")
DEFAULT_WORK = Path("build/suite")
RESULT_FILE = "result.json"
TABLE_WIDTH = 128

DESCRIPTION = """\
Simulates every scene with several seeds, flies each flight with the range finder and without, scores both, and writes
the means and the worst values as Markdown. It can be stopped and goes on where it was: flights and figures are used
again while scene file, seed, simulator and flight software are the same."""

EXAMPLES = """\
examples:
  tools/score --suite                                    all scenes, 5 seeds each, into docs/results.md
  tools/score --suite --scenes outdoor,indoor --seeds 10
  tools/score --suite --seeds 1 --keep --out /tmp/results.md

exit codes: 0 written, 1 a step failed, 2 bad input, 130 interrupted"""

INTRODUCTION = """\
# Results

Scenes of `tools/scenes`, each simulated with several seeds: the same scene with other noise, biases and clocks. Each
flight is flown twice by the same flight software with the same settings; VIO only leaves the range finder out. The
images are rendered, and the whole front end works on them.

Errors per axis are those after alignment in position and heading at the first pose, in percent of the distance
travelled; ATE is the root mean square position error after alignment in position and heading over the flight. NEES is
the mean over a flight, ideally 3. Entries are the mean over the seeds and, in brackets, the worst; of signed figures
the size counts. CPU time is that of one image, front end included."""


@dataclass(frozen=True)
class SceneResults:
    """All flights of one scene."""

    scene: Scene
    outcomes: list[Outcome]


def _seeds(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError("must be at least 1")
    return value


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="score --suite",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--suite", action="store_true", required=True, help="this help is about the suite")
    parser.add_argument("--scenes", metavar="A,B", help="scenes by name or file (default: all of tools/scenes)")
    parser.add_argument("--seeds", metavar="N", type=_seeds, default=DEFAULT_SEEDS, help="default: %(default)s")
    parser.add_argument("--out", metavar="FILE", type=Path, default=ROOT / DEFAULT_OUT, help=f"default: {DEFAULT_OUT}")
    parser.add_argument("--keep", action="store_true", help="keep flights and replays, not only their figures")
    parser.add_argument(
        "--work", metavar="DIR", type=Path, default=ROOT / DEFAULT_WORK, help=f"default: {DEFAULT_WORK}"
    )
    return parser


def _result_key(scene: Scene, seed: int) -> dict[str, Any]:
    """What determines the figures of a flight."""
    if not pipeline.REPLAY.exists():
        raise StepFailed("plumb-replay is not built: cmake --preset flight && cmake --build --preset flight")
    return {**pipeline.stamp(scene, seed), "replay": pipeline.digest(pipeline.REPLAY)}


def fly_one(steps: Steps, scene: Scene, seed: int, folders: Folders, keep: bool) -> Outcome:
    """Figures of one seed of a scene: from before when they are still right, else flown."""
    key = _result_key(scene, seed)
    known = pipeline.read_json(folders.base / RESULT_FILE)
    if isinstance(known, dict) and known.get("key") == key:
        try:
            outcome = Outcome.from_json(known["outcome"])
        except (KeyError, TypeError):
            pass  # written by another version of this tool: flown anew
        else:
            steps.note(f"{scene.name}, seed {seed}", 0.0, "figures there already")
            return outcome
    pipeline.simulate(steps, scene, seed, folders)
    pipeline.fly(steps, f"{scene.name}, seed {seed}", folders.flight, folders)
    outcome = pipeline.judge(scene.name, seed, folders.flight, folders)
    pipeline.write_json(folders.base / RESULT_FILE, {"key": key, "outcome": outcome.as_json()})
    if not keep:
        for folder in (folders.flight, *(folders.run(name) for name, _ in outcome.replays())):
            shutil.rmtree(folder)
    return outcome


def _entry(figures: Sequence[Figures], column: Column) -> str:
    both = mean_and_worst(figures, column)
    if both is None:
        return NONE
    mean, worst = both
    if len(figures) == 1:
        return f"{mean:.{column.digits}f}"
    return f"{mean:.{column.digits}f} ({worst:.{column.digits}f})"


def _markdown_table(results: Sequence[SceneResults]) -> list[str]:
    head = ["scene", "flown as", "flights", *(f"{column.title} [{column.unit}]" for column in COLUMNS)]
    lines = ["| " + " | ".join(head) + " |", "|---|---|---:|" + "---:|" * len(COLUMNS)]
    for result in results:
        for index, name in enumerate(name for name, _ in result.outcomes[0].replays()):
            figures = [found for outcome in result.outcomes if (found := outcome.replays()[index][1]) is not None]
            flown = len(result.outcomes)
            count = str(flown) if len(figures) == flown else f"{len(figures)} of {flown}"
            shown = f"**{name}**" if name == RANGE_VIO else name
            cells = [result.scene.name if index == 0 else "", shown, count, *(_entry(figures, c) for c in COLUMNS)]
            lines.append("| " + " | ".join(cells) + " |")
    return lines


def _scene_text(result: SceneResults) -> list[str]:
    scored = [figures for outcome in result.outcomes if (figures := outcome.range_vio or outcome.vio) is not None]
    length = f" ({scored[0].headline.distance_m:.0f} m)" if scored else ""
    ratio = error_ratio(result.outcomes)
    compared = "" if ratio is None else f" The greatest error of VIO is {ratio:.1f} times that of range-VIO."
    summary = result.scene.summary.rstrip(".") or "no summary in the scene file"
    lines = [f"* **{result.scene.name}**{length}: {summary}.{compared}"]
    for outcome in result.outcomes:
        for name, why in outcome.reasons.items():
            lines.append(f"  Seed {outcome.seed}, {name}: no solution ({_one_line(why)}).")
    return lines


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
    commands = ["tools/setup", "cmake --preset flight", "cmake --build --preset flight", command]
    lines += ["", "## How this page is made", "", *(f"    {line}" for line in commands), ""]
    lines.append(f"CPU times and real-time factors are from {_processor()}, two flights at a time.")
    return "\n".join(lines) + "\n"


def _suite(arguments: argparse.Namespace, console: Console) -> None:
    names = pipeline.known_scenes() if arguments.scenes is None else arguments.scenes.split(",")
    scenes = [pipeline.find_scene(name) for name in names]
    if not scenes:
        raise InputError(f"{pipeline.SCENES.relative_to(ROOT)} holds no scene")
    steps = Steps(console)
    results = []
    for scene in scenes:
        outcomes = []
        for seed in range(1, arguments.seeds + 1):
            folders = Folders(arguments.work / scene.name / f"seed-{seed}")
            outcomes.append(fly_one(steps, scene, seed, folders, arguments.keep))
        console.print(terminal_table(outcomes))
        results.append(SceneResults(scene, outcomes))
    options = "" if arguments.scenes is None else f" --scenes {arguments.scenes}"
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    command = f"tools/score --suite{options} --seeds {arguments.seeds}"
    arguments.out.write_text(markdown(results, command), encoding="utf-8")
    console.print(f"score: {arguments.out}", highlight=False, soft_wrap=True)


def main(argv: list[str]) -> int:
    """Runs the suite as the arguments tell; returns the exit code."""
    arguments = _parser().parse_args(argv)
    console = Console()
    try:
        _suite(arguments, console if console.is_terminal else Console(width=TABLE_WIDTH))
    except StepFailed as error:
        print(f"score: {error}", file=sys.stderr)
        return EXIT_FAILED
    except (InputError, OSError) as error:
        print(f"score: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print("score: interrupted; the same command goes on where it was", file=sys.stderr)
        return EXIT_INTERRUPTED
    return 0
