"""Command line of the flight simulator."""

from __future__ import annotations

import argparse
import signal
import sys
import time
from concurrent.futures import BrokenExecutor
from contextlib import nullcontext
from pathlib import Path
from types import FrameType

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from plumb_tools import files, heartbeat
from plumb_tools.arguments import positive_seconds, whole_number
from plumb_tools.sim import scene_file
from plumb_tools.trajectory import InputError

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130

DESCRIPTION = """\
Simulates a flight: rendered images, IMU and laser range with exact truth.

SCENE  one of the scenes that come with the project (--list), or a .yaml file: copy one from tools/scenes and change it

Writes a folder in the ASL (EuRoC) layout with the range sensor and the truth, the scene as flown with all defaults
filled in, and an LCM log of the raw bytes the devices would have sent. The same scene and seed give the same bytes;
a flight that is there already is not simulated again."""

EXAMPLES = """\
examples:
  tools/simulate --list                          the scenes that come with the project
  tools/simulate outdoor                         into build/flights/outdoor-0
  tools/simulate indoor --seed 3 --out /tmp/i3   other noise, biases and gusts, other folder
  tools/simulate my.yaml --duration 20           the first 20 s of a scene of your own
  tools/simulate mars --textures photos          with your pictures: those named after a material (grass.jpg,
                                                 roof_tiles.png, ...) replace its texture, others cover the ground

exit codes: 0 flown, 2 bad input, 130 interrupted (nothing is left behind)"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="simulate",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scene", metavar="SCENE", nargs="?")
    parser.add_argument("--out", metavar="DIR", type=Path, help="folder to write (default: build/flights/SCENE-SEED)")
    parser.add_argument("--seed", metavar="N", type=whole_number(0), default=0, help="of what is random (default: 0)")
    parser.add_argument("--textures", metavar="DIR", type=Path, help="your own pictures for materials and ground")
    parser.add_argument("--duration", metavar="S", type=positive_seconds, help="fly only the first S seconds")
    parser.add_argument("--list", action="store_true", help="list the scenes and exit")
    parser.add_argument("--no-log", action="store_true", help="leave out the LCM log of raw device bytes")
    return parser


def _list() -> None:
    console = Console()
    for name in scene_file.names():
        scene = scene_file.read(scene_file.find(name))
        line = f"[bold]{name:11}[/] {scene.trajectory.length_s:4.0f} s  {scene.scene.summary}"
        console.print(line, highlight=False, soft_wrap=True)


class _Bar:
    """Shows what is being done; steps of which the number is known get a bar, or lines where there is no terminal."""

    def __init__(self) -> None:
        console = Console(stderr=True)
        self._drawn = console.is_terminal
        self._told, self._told_at_s = 0, time.monotonic()
        self._progress = Progress(
            TextColumn("{task.description:28}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console,
            disable=not self._drawn,
        )
        self._task: TaskID | None = None
        self._step = ""
        self._state = "starting"
        self._life = nullcontext() if self._drawn else heartbeat.every(heartbeat.PERIOD_S / 4.0, self._go_on)

    def __enter__(self) -> _Bar:
        self._progress.start()
        self._life.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._life.__exit__(None, None, None)
        if self._task is not None:
            self._progress.remove_task(self._task)
        self._progress.stop()

    def __call__(self, step: str, done: int, total: int) -> None:
        """Takes note of progress."""
        if not self._drawn:
            self._tell(step, done, total)
        if step != self._step:
            if self._task is not None:
                self._progress.remove_task(self._task)
            self._task, self._step = self._progress.add_task(step, total=total or None), step
        if self._task is not None:
            self._progress.update(self._task, completed=done)

    def _tell(self, step: str, done: int, total: int) -> None:
        """A line at the start of a step and at every other percent of it: the demo makes its bar of these."""
        part = 50 * done // total if total else 0
        if step != self._step or part != self._told:
            self._state = f"{step}{f', {done} of {total}' if total else ''}"
            self._line(self._state)
        self._told = part

    def _go_on(self, seconds: float) -> None:
        """The last line again when there was none for long: some steps do not know how far they are."""
        if time.monotonic() - self._told_at_s >= heartbeat.PERIOD_S:
            self._line(f"{self._state}, {seconds:.0f} s since the start")

    def _line(self, text: str) -> None:
        self._told_at_s = time.monotonic()
        print(f"simulate: {text}", file=sys.stderr, flush=True)


def _simulate(arguments: argparse.Namespace) -> None:
    path = scene_file.find(arguments.scene)
    scene = scene_file.read(path)
    target = arguments.out or scene_file.flight_folder(path, arguments.seed)
    # These cost a second or two to load: only when a flight is wanted.
    from plumb_tools.sim import kept, prepare, renderer, simulate
    from plumb_tools.sim.devices.stim300 import RATE_CODES

    if not arguments.no_log and scene.sensors.imu.rate_hz not in RATE_CODES:
        rates = ", ".join(map(str, RATE_CODES))
        raise InputError(
            f"{path}: sensors.imu.rate_hz: {scene.sensors.imu.rate_hz:g}; the log of raw bytes is that of a STIM300, "
            f"expected one of {rates} Hz, or --no-log"
        )
    started = time.monotonic()
    wanted = kept.origin(scene, arguments.seed, arguments.duration, arguments.textures, not arguments.no_log)
    if kept.holds(target, wanted):
        print(f"{target}: there already")
        return
    if (damage := kept.damage(target, wanted)) is not None:
        print(f"simulate: {target}: {damage}; simulated anew", file=sys.stderr)
    kept.expect_replaceable(target)
    software = renderer.software_renderer()
    if software is not None:
        print(f"simulate: no GPU, drawing in software ({software})", file=sys.stderr)
    with _Bar() as bar:
        plan = prepare.plan(scene, path, arguments.seed, arguments.duration, arguments.textures, bar)
        simulate.fly(plan, target, wanted, bar)
    took = time.monotonic() - started
    print(f"{target}: {plan.length_s:.1f} s of flight in {took:.0f} s")


def _ignore(_signal: int, _frame: FrameType | None) -> None:
    """Not SIG_IGN: Python tells of a signal that had come before it was set, with a traceback."""


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    """Once: whoever stops a program often does so twice, and clearing up must not be stopped."""
    for stopping in (signal.SIGINT, signal.SIGTERM):
        signal.signal(stopping, _ignore)
    raise KeyboardInterrupt


def _is_interrupted(error: BaseException) -> bool:
    """Whether an error comes of an interrupt: within a lock of the standard library one turns into another error."""
    ignored = signal.getsignal(signal.SIGINT) is _ignore
    return isinstance(error, KeyboardInterrupt) or (isinstance(error, RuntimeError) and ignored)


def main(argv: list[str] | None = None) -> int:
    """Simulates as the arguments tell; returns the exit code."""
    parser = _parser()
    arguments = parser.parse_args(argv)
    for stopping in (signal.SIGINT, signal.SIGTERM):
        signal.signal(stopping, _interrupt)
    try:
        if arguments.list:
            _list()
            return 0
        if arguments.scene is None:
            parser.error("SCENE is missing; --list shows those that come with the project")
        _simulate(arguments)
    except BrokenExecutor:
        print("simulate: a drawing process died, perhaps for want of memory; nothing is left behind", file=sys.stderr)
        return EXIT_BAD_INPUT
    except (KeyboardInterrupt, RuntimeError) as error:
        if not _is_interrupted(error):
            raise
        print("simulate: interrupted, nothing is left behind", file=sys.stderr)
        return EXIT_INTERRUPTED
    except InputError as error:
        for line in str(error).splitlines():
            print(f"simulate: {line}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except OSError as error:
        print(f"simulate: {files.told(error)}; nothing is left behind", file=sys.stderr)
        return EXIT_BAD_INPUT
    return 0


if __name__ == "__main__":
    sys.exit(main())
