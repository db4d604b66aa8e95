"""`tools/score --suite`: every scene with several seeds, flown with and without range, as a table in Markdown."""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from plumb_tools import files
from plumb_tools.arguments import whole_number
from plumb_tools.demo import pipeline
from plumb_tools.demo.pipeline import ROOT, Folders, Scene
from plumb_tools.demo.process import Steps, exit_code
from plumb_tools.demo.results import Outcome, footnotes, terminal_table
from plumb_tools.score.results_page import SceneResults, markdown
from plumb_tools.sim import kept, scene_file
from plumb_tools.trajectory import InputError

DEFAULT_SEEDS = 5
MOST_SEEDS = 1000
DEFAULT_OUT = Path("docs/results.md")
DEFAULT_WORK = Path("build/suite")
RESULT_FILE = "result.json"
TABLE_WIDTH = 128

DESCRIPTION = """\
Builds, simulates every scene with several seeds, flies each flight with the range finder and without, scores both,
and writes the means and the worst values as Markdown. Some of the scenes are only printed unless --out names a file:
docs/results.md has them all. It can be stopped and goes on where it was. Flights are kept in
build/flights and used again while scene, seed and simulator are the same, so that a changed estimator only flies them
anew; they take 5 MB per second of flight."""

EXAMPLES = """\
examples:
  tools/score --suite                                      all scenes, 5 seeds each, into docs/results.md
  tools/score --suite --scenes outdoor,indoor --seeds 10
  tools/score --suite --scenes outdoor:5,hover --seeds 1   seeds scene by scene: 5 of outdoor, 1 of hover
  tools/score --suite --seeds 1 --discard --out /tmp/results.md

exit codes: 0 done, 1 a step failed, 2 bad input, 130 interrupted"""


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
    parser.add_argument("--first-seed", metavar="N", type=whole_number(1), default=1, help="default: %(default)s")
    parser.add_argument("--out", metavar="FILE", type=Path, help=f"default, of all scenes: {DEFAULT_OUT}")
    parser.add_argument("--discard", action="store_true", help="delete each flight once it is scored")
    parser.add_argument(
        "--work", metavar="DIR", type=Path, default=ROOT / DEFAULT_WORK, help=f"replays; default: {DEFAULT_WORK}"
    )
    return parser


def wanted(scenes: str | None, seeds: int) -> list[Wanted]:
    """What `--scenes` and `--seeds` ask for."""
    found: dict[str, Wanted] = {}
    for item in scene_file.names() if scenes is None else scenes.split(","):
        name, colon, count = item.partition(":")
        if colon and not (count.isdecimal() and 0 < int(count) <= MOST_SEEDS):
            raise InputError(f"--scenes {item}: expected a number of seeds, 1 to {MOST_SEEDS}, after the colon")
        try:
            scene = pipeline.find_scene(name)
        except InputError as error:
            raise InputError(f"--scenes: {error}") from None
        if scene.name in found:  # flights and figures are kept by this name
            raise InputError(f"--scenes {scenes}: {scene.name} stands there twice; expected every scene once")
        found[scene.name] = Wanted(scene, int(count) if colon else seeds)
    return list(found.values())


def _page_file(out: Path | None, items: list[Wanted]) -> Path | None:
    """Where the page goes; None when it is only printed, because a part of the scenes is not the project's results."""
    if out is not None:
        return out
    chosen = {item.scene.file for item in items}
    return ROOT / DEFAULT_OUT if chosen == {scene_file.find(name) for name in scene_file.names()} else None


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
    result = {"key": key, "outcome": outcome.as_json()}
    files.write_text(folders.base / RESULT_FILE, json.dumps(result, indent=2) + "\n")
    if discard:
        kept.remove(flight)
    return outcome


def _suite(arguments: argparse.Namespace, console: Console) -> None:
    steps = Steps(console)
    results = []
    items = wanted(arguments.scenes, arguments.seeds)
    page = _page_file(arguments.out, items)
    if page is not None:
        files.expect_file(page, "--out")
    files.expect_folder(arguments.work, "--work")
    pipeline.build(steps, arguments.work)
    for item in items:
        outcomes = []
        for seed in range(arguments.first_seed, arguments.first_seed + item.seeds):
            folders = Folders(arguments.work / item.scene.name / f"seed-{seed}")
            outcomes.append(fly_one(steps, item.scene, seed, folders, arguments.discard))
        console.print(terminal_table(outcomes, console.width))
        for line in footnotes(outcomes):
            console.print(line, highlight=False, markup=False)
        results.append(SceneResults(item.scene, outcomes))
    options = "" if arguments.scenes is None else f" --scenes {arguments.scenes}"
    options += "" if arguments.first_seed == 1 else f" --first-seed {arguments.first_seed}"
    text = markdown(results, f"tools/score --suite{options} --seeds {arguments.seeds}")
    if page is None:
        console.print(text, highlight=False, markup=False, soft_wrap=True)
        console.print(f"score: not all scenes, {DEFAULT_OUT} stays as it is; --out FILE writes a page of these")
    else:
        files.write_text(page, text)
        console.print(f"score: {page}", highlight=False, soft_wrap=True)


def main(argv: list[str]) -> int:
    """Runs the suite as the arguments tell; returns the exit code."""
    arguments = _parser().parse_args(argv)
    console = Console()
    sized = console if console.is_terminal else Console(width=TABLE_WIDTH)
    return exit_code("score", lambda: _suite(arguments, sized), "the same command goes on where it was")
