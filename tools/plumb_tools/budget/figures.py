"""Measures what the flight software costs: memory, stacks, heap calls and instructions."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plumb_tools.demo.pipeline import ROOT, replay_summary
from plumb_tools.demo.process import StepFailed

PROCESS = "plumb-fsw"
#: Folders of the flight software, whose stacks the compiler works out.
FLIGHT_FOLDERS = ("fsw", "drivers")
#: Folders whose libraries the process is made of.
LINKED_FOLDERS = (*FLIGHT_FOLDERS, "hal", "config", "process")

#: Threads of plumb-fsw that may take from the heap: the one that starts and ends a flight, and that of LCM's receiver.
HEAP_USERS = (PROCESS, "command")

#: The shell that prepares a live flight, and which it is.
FLIGHTS = (
    ("unit/telemetry/in_namespace.sh", "NetworkLiveFlight.*"),
    ("emulators/in_user_mode_linux.sh", "KernelLiveFlight.*"),
)

sys.path.insert(0, str(ROOT / "test" / "budget"))
import instruction_budget  # noqa: E402
import tick_budget  # noqa: E402


@dataclass(frozen=True)
class Figure:
    """One thing measured."""

    key: str  #: in budgets.yaml
    what: str
    value: float


def _lines(command: list[str | Path]) -> list[str]:
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True).stdout.splitlines()


def sections(build: Path) -> Iterator[Figure]:
    """Of the flight process and of each library that flies in it."""
    text, data, bss = _lines(["size", build / "bin" / PROCESS])[1].split()[:3]
    yield Figure("process.text", f"{PROCESS}: code and constants", float(text))
    yield Figure("process.data", f"{PROCESS}: initialised data", float(data))
    yield Figure("process.bss", f"{PROCESS}: static memory", float(bss))
    for folder in sorted({library.parent for top in LINKED_FOLDERS for library in (build / top).rglob("*.a")}):
        name = folder.relative_to(build).as_posix()
        objects = [line.split()[:3] for library in folder.glob("*.a") for line in _lines(["size", library])[1:]]
        code, initialised, zeroed = (sum(int(row[column]) for row in objects) for column in range(3))
        yield Figure(f"text.{name}", f"{name}: code", float(code))
        if initialised + zeroed > 0:
            yield Figure(f"ram.{name}", f"{name}: static memory, initialised and not", float(initialised + zeroed))


def stacks(build: Path) -> Iterator[Figure]:
    """Of the functions in the flight libraries, as the compiler worked them out (-fstack-usage)."""
    deepest, unbounded = 0, 0
    for folder in FLIGHT_FOLDERS:
        for report in (build / folder).rglob("*.su"):
            for line in report.read_text(encoding="utf-8").splitlines():
                _, size, kind = line.split("\t")
                deepest = max(deepest, int(size))
                unbounded += kind == "dynamic"
    yield Figure("stack.frame", "largest stack frame of a function", float(deepest))
    yield Figure("stack.unbounded", "functions whose frame the compiler cannot bound", float(unbounded))


def said_at_the_end(text: str) -> Iterator[Figure]:
    """Memory in all and how deep the stack of each thread was, by what plumb-fsw says at the end of a flight."""
    for mib in re.findall(r"^memory at most ([\d.]+) MiB$", text, re.MULTILINE):
        yield Figure("memory.flight", "resident memory of plumb-fsw at most, all of it locked", float(mib) * 2.0**20)
    threads = re.findall(r"^thread (\w+) +stack used (\d+) of \d+ bytes, page faults (\d+)$", text, re.MULTILINE)
    for name, used, _ in threads:
        yield Figure(f"thread.{name}", f"thread {name}: stack used", float(used))
    yield Figure("faults.flight", "page faults of all threads of plumb-fsw", float(sum(int(row[2]) for row in threads)))
    callers = re.findall(r"^heap calls of thread (\S+): (\d+)$", text, re.MULTILINE)
    if callers:  # starting a flight takes memory: otherwise nobody counted
        calls = sum(int(count) for name, count in callers if name not in HEAP_USERS)
        yield Figure("heap.flight", "heap calls of the threads that fly, from their beginning to their end", float(calls))


def flown(build: Path) -> list[Figure]:
    """Memory and threads of plumb-fsw on two short live flights with emulated devices, of each figure the larger one:
    commanded over LCM, and under a kernel that has the range finder's CAN bus.
    """
    largest: dict[str, Figure] = {}
    for where, flights in FLIGHTS:
        command = [str(ROOT / "test" / where), str(build / "test" / "test_live"), f"--gtest_filter={flights}"]
        flight = subprocess.run(command, capture_output=True, text=True, check=False)
        figures = list(said_at_the_end(flight.stdout))
        if flight.returncode != 0 or not figures:
            raise StepFailed(f"{' '.join(command)} failed:\n{flight.stdout}{flight.stderr}")
        for figure in figures:
            largest[figure.key] = max(figure, largest.get(figure.key, figure), key=lambda each: each.value)
    return list(largest.values())


def replayed(recording: Path) -> Iterator[Figure]:
    """Heap calls and memory of a whole recorded flight."""
    summary = replay_summary(recording)
    yield Figure("heap.calls", "heap calls in estimator, tracker and the rest of fsw",
                 float(sum(summary["heap_calls"].values())))  # fmt: skip
    yield Figure("memory.replay", "resident memory of a replay at most, its reading of images included",
                 summary["peak_rss_mib"] * 2.0**20)  # fmt: skip


def instructions(build: Path, recording: Path, images: int) -> Iterator[Figure]:
    """On 64-bit ARM, mean over the images that the running filter processed."""
    costs, _ = instruction_budget.count(build, recording, "flight", images)
    names = list(instruction_budget.REGIONS.values())
    means = dict(zip(names, costs.mean(axis=0), strict=True))
    front_end = sum(means[name] for name in instruction_budget.FRONT_END)
    yield Figure("arm64.front_end", "front end, instructions an image", front_end)
    yield Figure("arm64.filter", "filter, instructions an image", float(np.sum(costs.mean(axis=0))) - front_end)
    yield Figure("arm64.image", "whole image, instructions", float(np.sum(costs.mean(axis=0))))
    for what, runs in tick_budget.count(build, recording, images).items():
        if what == tick_budget.WHOLE_TICK:
            yield Figure("arm64.tick", "tick, instructions", float(runs.mean()))
        elif what != tick_budget.REST_OF_TICK:
            yield Figure(f"arm64.job.{what}", f"job {what}, instructions a run", float(runs.mean()))
