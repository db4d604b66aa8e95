"""Command line of the demo; tools/demo sets up first."""

from __future__ import annotations

import argparse
import os
import sys
import webbrowser
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

from rich.console import Console

from plumb_tools import files
from plumb_tools.arguments import whole_number
from plumb_tools.demo import pipeline
from plumb_tools.demo.pipeline import ROOT, Folders, Scene
from plumb_tools.demo.process import Steps, exit_code
from plumb_tools.demo.results import Outcome, footnotes, terminal_table
from plumb_tools.report.__main__ import DEFAULT_IMAGES, write_report
from plumb_tools.sim import scene_file
from plumb_tools.trajectory import InputError

DEMO_SCENE = "demo"
DEFAULT_OUT = Path("build/demo")
TABLE_WIDTH = 128  #: of the output where it does not go to a terminal

DESCRIPTION = """\
Shows Plumb at work: sets up, builds, simulates a flight, flies the flight software on it with the range finder and
without, scores both, and opens a report. Nothing that is there already is made again."""

EXAMPLES = """\
examples:
  tools/demo                           one short flight, from nothing to the open report
  tools/demo --full                    every scene of tools/scenes, which takes much longer
  tools/demo --seed 7 --no-open        another realisation of the noise; only print where the report is
  tools/demo --flight ../mh01          fly a recording in ASL layout instead of a simulated flight

exit codes: 0 done, 1 a step failed, 2 bad input, 130 interrupted"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="demo",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--full", action="store_true", help="fly every scene")
    what.add_argument("--flight", metavar="DIR", type=Path, help="fly this recording (the folder that holds mav0)")
    parser.add_argument("--seed", metavar="N", type=whole_number(0), default=1, help="of the simulation (default: 1)")
    parser.add_argument("--out", metavar="DIR", type=Path, default=ROOT / DEFAULT_OUT, help=f"default: {DEFAULT_OUT}")
    parser.add_argument("--no-open", action="store_true", help="do not open the report in a browser")
    parser.add_argument("--setup-seconds", type=float, default=0.0, help=argparse.SUPPRESS)  # told by tools/demo
    return parser


@dataclass(frozen=True)
class _Shown:
    """What came of a flight."""

    outcome: Outcome
    page: Path | None  #: the report; None when no replay gave anything to show


def _show(steps: Steps, name: str, flight: Path, folders: Folders) -> _Shown:
    """Flies a flight, judges it and writes its report."""
    page = folders.base / "report.html"
    page.unlink(missing_ok=True)  # what is there in the end is of this flight
    pipeline.fly(steps, name, flight, folders)
    with steps.step(f"score and report {name}") as step:
        tell = step.working("scoring")
        outcome = pipeline.judge(name, None, flight, folders)
        runs, absent = pipeline.read_runs(folders)
        if runs:
            write_report(flight, list(runs.values()), absent, page, DEFAULT_IMAGES, tell)
    return _Shown(outcome, page if runs else None)


def _fly_all(arguments: argparse.Namespace, steps: Steps) -> list[_Shown]:
    out: Path = arguments.out
    shown: list[_Shown] = []
    if arguments.flight is not None:
        name = arguments.flight.resolve().name
        shown.append(_show(steps, name, arguments.flight, Folders(out / name)))
    else:
        names = scene_file.names() if arguments.full else [DEMO_SCENE]
        scenes: list[Scene] = [pipeline.find_scene(name) for name in names]
        for scene in scenes:
            folders = Folders(out / scene.name)
            flight = pipeline.simulate(steps, scene, arguments.seed, folders.log("simulate"))
            shown.append(_show(steps, scene.name, flight, folders))
    return shown


def _has_display() -> bool:
    return sys.platform == "darwin" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _demo(arguments: argparse.Namespace, console: Console) -> None:
    started = monotonic() - arguments.setup_seconds
    steps = Steps(console)
    steps.note("set up", arguments.setup_seconds)
    files.expect_folder(arguments.out, "--out")
    if arguments.flight is not None and not (arguments.flight / "mav0").is_dir():
        raise InputError(f"--flight {arguments.flight}: holds no mav0; expected a folder in ASL layout")
    pipeline.build(steps, arguments.out)
    shown = _fly_all(arguments, steps)
    outcomes = [flight.outcome for flight in shown]
    steps.note("everything", monotonic() - started)
    console.print()
    console.print(terminal_table(outcomes, console.width))
    for line in footnotes(outcomes):
        console.print(line, style="yellow", highlight=False, markup=False)
    pages = [flight.page for flight in shown if flight.page is not None]
    for page in pages:
        console.print(f"report  {page}", highlight=False, soft_wrap=True)
    if not pages:
        console.print("no report: there is no replay with a state to show", style="yellow")
    elif not arguments.no_open and _has_display():
        webbrowser.open(pages[0].resolve().as_uri())


def main(argv: list[str] | None = None) -> int:
    """Runs the demo as the arguments tell; returns the exit code."""
    arguments = _parser().parse_args(argv)
    console = Console()
    sized = console if console.is_terminal else Console(width=TABLE_WIDTH)
    return exit_code("demo", lambda: _demo(arguments, sized), "run it again to go on")


if __name__ == "__main__":
    sys.exit(main())
