"""`tools/score --suite`: every scene with several seeds, flown with and without range, as a table in Markdown."""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from plumb_tools.arguments import whole_number
from plumb_tools.demo import pipeline
from plumb_tools.demo.pipeline import ROOT, Folders, Scene
from plumb_tools.demo.process import StepFailed, Steps
from plumb_tools.demo.results import Outcome, terminal_table
from plumb_tools.score.results_page import SceneResults, markdown
from plumb_tools.sim import kept, scene_file
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
Builds, simulates every scene with several seeds, flies each flight with the range finder and without, scores both,
and writes the means and the worst values as Markdown. It can be stopped and goes on where it was. Flights are kept in
build/flights and used again while scene, seed and simulator are the same, so that a changed estimator only flies them
anew; they take 5 MB per second of flight."""

EXAMPLES = """\
examples:
  tools/score --suite                                      all scenes, 5 seeds each, into docs/results.md
  tools/score --suite --scenes outdoor,indoor --seeds 10
  tools/score --suite --scenes outdoor:5,indoor:5,hover:1  seeds scene by scene
  tools/score --suite --seeds 1 --discard --out /tmp/results.md

exit codes: 0 written, 1 a step failed, 2 bad input, 130 interrupted"""

@dataclass(frozen=True)
class Wanted:
    """A scene to fly."""

    scene: Scene
    seeds: int


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="score --suite",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--suite", action="store_true", required=True, help="this help is about the suite")
    parser.add_argument("--scenes", metavar="A,B:N", help="scenes by name or file (default: all of tools/scenes)")
    parser.add_argument("--seeds", metavar="N", type=whole_number(1), default=DEFAULT_SEEDS, help="default: %(default)s")
    parser.add_argument("--out", metavar="FILE", type=Path, default=ROOT / DEFAULT_OUT, help=f"default: {DEFAULT_OUT}")
    parser.add_argument("--discard", action="store_true", help="delete each flight once it is scored")
    parser.add_argument(
        "--work", metavar="DIR", type=Path, default=ROOT / DEFAULT_WORK, help=f"replays; default: {DEFAULT_WORK}"
    )
    return parser


def wanted(scenes: str | None, seeds: int) -> list[Wanted]:
    """What `--scenes` and `--seeds` ask for."""
    found = []
    for item in scene_file.names() if scenes is None else scenes.split(","):
        name, colon, count = item.partition(":")
        if colon and not (count.isdecimal() and int(count) > 0):
            raise InputError(f"--scenes {item}: expected a number of seeds, at least 1, after the colon")
        found.append(Wanted(pipeline.find_scene(name), int(count) if colon else seeds))
    return found


def _result_key(scene: Scene, seed: int) -> dict[str, Any]:
    """What determines the figures of a flight."""
    return {"flight": vars(scene.origin(seed)), "replay": pipeline.replay_digest()}


def fly_one(steps: Steps, scene: Scene, seed: int, folders: Folders, discard: bool) -> Outcome:
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
    flight = pipeline.simulate(steps, scene, seed, folders.log("simulate"))
    pipeline.fly(steps, f"{scene.name}, seed {seed}", flight, folders)
    outcome = pipeline.judge(scene.name, seed, flight, folders)
    pipeline.write_json(folders.base / RESULT_FILE, {"key": key, "outcome": outcome.as_json()})
    if discard:
        kept.remove(flight)
    return outcome


def _suite(arguments: argparse.Namespace, console: Console) -> None:
    steps = Steps(console)
    results = []
    items = wanted(arguments.scenes, arguments.seeds)
    pipeline.build(steps, arguments.work)
    for item in items:
        outcomes = []
        for seed in range(1, item.seeds + 1):
            folders = Folders(arguments.work / item.scene.name / f"seed-{seed}")
            outcomes.append(fly_one(steps, item.scene, seed, folders, arguments.discard))
        console.print(terminal_table(outcomes, console.width))
        results.append(SceneResults(item.scene, outcomes))
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
