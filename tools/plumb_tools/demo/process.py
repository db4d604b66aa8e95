"""Runs the other tools: their output into a log, their progress onto a bar."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from time import monotonic

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TaskProgressColumn, TextColumn, TimeElapsedColumn

from plumb_tools import files, heartbeat
from plumb_tools.trajectory import InputError

#: What tools write of their progress: "[12/47]", " 30 %", "image 60 of 600".
_PARTS = re.compile(r"\b(\d+) ?(?:/|of) ?(\d+)\b")
_PERCENT = re.compile(r"\b(\d{1,3})(?:\.\d+)? ?%")

TAIL_LINES = 15


EXIT_FAILED = 1
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130


class StepFailed(Exception):
    """A tool ended with an error; the message has its last words."""


def exit_code(name: str, work: Callable[[], None], interrupted: str) -> int:
    """Does the work of the command `name` and tells what ended it; `interrupted` says how to go on."""
    try:
        work()
    except StepFailed as error:
        print(f"{name}: {error}", file=sys.stderr)
        return EXIT_FAILED
    except (InputError, OSError) as error:
        print(f"{name}: {files.told(error)}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print(f"{name}: interrupted; {interrupted}", file=sys.stderr)
        return EXIT_INTERRUPTED
    return 0


def progress_of(line: str) -> float | None:
    """Part of the work done that a line of output tells of, 0 to 1; None when it tells nothing."""
    if parts := _PARTS.search(line):
        done, total = int(parts[1]), int(parts[2])
        return done / total if 0 < total and done <= total else None
    if percent := _PERCENT.search(line):
        return min(1.0, int(percent[1]) / 100.0)
    return None


class Bar:
    """The progress of one tool."""

    def __init__(self, progress: Progress, task: TaskID) -> None:
        """For a task of a rich progress display."""
        self._progress = progress
        self._task = task

    def show(self, line: str) -> None:
        """Moves the bar when the line says how far the tool is."""
        done = progress_of(line)
        if done is not None:
            self._progress.update(self._task, completed=done)

    def time_of(self, lasts_s: float) -> Callable[[float], None]:
        """Moves the bar by the seconds since the start of what lasts so long."""
        return lambda seconds: self._progress.update(self._task, completed=min(1.0, seconds / lasts_s))

    def end(self) -> None:
        """The tool has ended: there is nothing more to tell of it."""
        self._progress.stop_task(self._task)


class Step:
    """A step of the work with a bar per tool that it runs."""

    def __init__(self, progress: Progress) -> None:
        """Inside a rich progress display."""
        self._progress = progress
        self._running: list[subprocess.Popen[str]] = []
        self._stopped = False

    def working(self, title: str) -> Callable[[str], None]:
        """A bar for work of unknown length that is done here; to be told what is being done."""
        task = self._progress.add_task(title, total=None)
        return lambda text: self._progress.update(task, description=text)

    def state(self) -> str:
        """What is being done and how much of it is done, in a line."""
        under_way = [task for task in self._progress.tasks if task.stop_time is None]
        return ", ".join(
            f"{task.description} {task.percentage:.0f} %" if task.completed else task.description for task in under_way
        )

    def stop(self) -> None:
        """Ends what this step runs, from whatever thread."""
        self._stopped = True
        for process in self._running:
            process.terminate()

    def run(self, title: str, command: Sequence[str | Path], log: Path, lasts_s: float | None = None) -> None:
        """Runs a command; its output goes to the log file. Throws StepFailed.

        The bar shows the progress that the output tells of, or the time of a command that `lasts_s`.
        """
        bar = Bar(self._progress, self._progress.add_task(title, total=1.0))
        words = [str(word) for word in command]
        tail: deque[str] = deque(maxlen=TAIL_LINES)
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("w", encoding="utf-8") as stream:
            stream.write(f"$ {shlex.join(words)}\n")
            try:
                process = subprocess.Popen(
                    words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
                )
            except OSError as error:
                raise StepFailed(f"{words[0]}: {error.strerror}") from None
            self._running.append(process)
            if self._stopped:
                process.terminate()
            with process, nullcontext() if lasts_s is None else heartbeat.every(1.0, bar.time_of(lasts_s)):
                assert process.stdout is not None
                for line in process.stdout:
                    stream.write(line)
                    tail.append(line.rstrip())
                    bar.show(line)
            self._running.remove(process)
            bar.end()
        if process.returncode != 0:
            last = "\n".join(f"  {line}" for line in tail if line)
            raise StepFailed(f"{shlex.join(words)} ended with {process.returncode}:\n{last}\n  (all of it in {log})")


class Steps:
    """Shows steps as they go and keeps the time of each."""

    def __init__(self, console: Console) -> None:
        """On a console; bars are drawn on a terminal, elsewhere lines tell now and then what goes on."""
        self.console = console
        self.times: list[tuple[str, float]] = []

    def note(self, title: str, seconds: float, remark: str = "") -> None:
        """Records a step that is over."""
        self.times.append((title, seconds))
        self.console.print(f"  {title:<34} [bold]{seconds:7.1f} s[/]  [dim]{remark}[/]", highlight=False)

    @contextmanager
    def step(self, title: str) -> Iterator[Step]:
        """A step; its time is shown when it has ended."""
        started = monotonic()
        columns = (TextColumn("  {task.description:<34}"), BarColumn(32), TaskProgressColumn(), TimeElapsedColumn())
        with Progress(*columns, console=self.console, transient=True, disable=not self.console.is_terminal) as bars:
            step = Step(bars)
            with nullcontext() if self.console.is_terminal else self._lines(title, step):
                try:
                    yield step
                except BaseException:
                    step.stop()
                    raise
        self.note(title, monotonic() - started)

    def _lines(self, title: str, step: Step) -> AbstractContextManager[None]:
        """A line at the start, and one in every period with how far the step is."""
        self.console.print(f"  {title} ...", highlight=False)

        def tell(seconds: float) -> None:
            line = f"    {step.state() or title}, {seconds:.0f} s"
            self.console.print(line, highlight=False, markup=False, soft_wrap=True)

        return heartbeat.every(heartbeat.PERIOD_S, tell)
