"""`tools/fuzz`: feeds the drivers and readers anything, and tells what came of it."""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from plumb_tools import files
from plumb_tools.arguments import whole_number
from plumb_tools.demo.pipeline import ROOT, build
from plumb_tools.demo.process import StepFailed, Steps, exit_code
from plumb_tools.trajectory import InputError

BUILD = ROOT / "build" / "fuzz"
SEEDS = ROOT / "test" / "fuzz" / "corpus"
PREFIX = "fuzz_"
DEFAULT_SECONDS = 60

DESCRIPTION = """\
Builds the fuzz targets of test/fuzz (clang 19 and its libFuzzer) and runs each for some seconds: what the devices send,
and the files that a user gives. An input that breaks an assertion, reads beyond its bounds or does not end is kept in
build/fuzz/findings; hand it to the program build/fuzz/bin/fuzz_... to see it again. Inputs that reach new code are kept
in build/fuzz/corpus, so that the next run goes on from there. Needs tools/setup --fuzz. Exits with 1 when anything is
found."""


@dataclass(frozen=True)
class Outcome:
    """What came of one target."""

    target: str
    executions: int
    per_second: int
    edges: int  #: of the code's branches, that any input reached
    corpus: int  #: inputs that each reach something new
    finding: str | None  #: where the input that broke it is kept


def targets() -> list[str]:
    """Names of what was built."""
    return sorted(path.name for path in (BUILD / "bin").glob(f"{PREFIX}*"))


def outcome_of(target: str, text: str) -> Outcome:
    """From the output of libFuzzer."""

    def last(pattern: str) -> int:
        found = re.findall(pattern, text)
        return int(found[-1]) if found else 0

    finding = re.search(r"Test unit written to (\S+)", text)
    return Outcome(
        target,
        last(r"stat::number_of_executed_units: (\d+)"),
        last(r"stat::average_exec_per_sec: +(\d+)"),
        last(r"cov: (\d+)"),
        last(r"corp: (\d+)/"),
        finding[1] if finding else None,
    )


def run(steps: Steps, target: str, seconds: int) -> Outcome:
    """Runs one target for so long, from the inputs that are known."""
    corpus, findings = BUILD / "corpus" / target, BUILD / "findings"
    corpus.mkdir(parents=True, exist_ok=True)
    findings.mkdir(parents=True, exist_ok=True)
    seeds = [str(SEEDS / target)] if (SEEDS / target).is_dir() else []
    options = [f"-max_total_time={seconds}", "-print_final_stats=1", "-timeout=10", f"-artifact_prefix={findings}/{target}-"]
    with steps.step(f"{target}, {seconds} s"):
        command = [str(BUILD / "bin" / target), *options, str(corpus), *seeds]
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
    files.write_text(BUILD / f"{target}.log", done.stderr)
    outcome = outcome_of(target, done.stderr)
    if done.returncode != 0 and outcome.finding is None:
        raise StepFailed(f"{target} ended with {done.returncode}: see {BUILD / f'{target}.log'}")
    return outcome


def _table(outcomes: Sequence[Outcome]) -> Table:
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for title in ("target", "executions", "a second", "edges", "inputs kept", "found"):
        table.add_column(title, justify="left" if title in ("target", "found") else "right")
    for o in outcomes:
        found = "[green]nothing[/]" if o.finding is None else f"[red]{o.finding}[/]"
        table.add_row(o.target, f"{o.executions:,}", f"{o.per_second:,}", str(o.edges), str(o.corpus), found)
    return table


def _fuzz(arguments: argparse.Namespace, console: Console) -> None:
    steps = Steps(console)
    build(steps, BUILD, "plumb_fuzz", "fuzz")
    known = targets()
    chosen = [name if name.startswith(PREFIX) else PREFIX + name for name in arguments.targets] or known
    for name in chosen:
        if name not in known:
            raise InputError(f"{name}: no such target; expected one of {', '.join(known)}")
    outcomes = [run(steps, target, arguments.seconds) for target in chosen]
    console.print(_table(outcomes))
    if found := [outcome.target for outcome in outcomes if outcome.finding is not None]:
        raise StepFailed(f"{', '.join(found)}: an input was found that breaks it")


def main(argv: Sequence[str] | None = None) -> int:
    """Fuzzes as the arguments tell; returns the exit code."""
    parser = argparse.ArgumentParser(prog="fuzz", description=DESCRIPTION)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="such as stim300_framer (default: all)")
    parser.add_argument(
        "--seconds", type=whole_number(1), default=DEFAULT_SECONDS, metavar="N", help="each (default: %(default)s)"
    )
    arguments = parser.parse_args(argv)
    console = Console(width=None if sys.stdout.isatty() else 120)
    return exit_code("fuzz", lambda: _fuzz(arguments, console), "the inputs found so far are kept")


if __name__ == "__main__":
    sys.exit(main())
