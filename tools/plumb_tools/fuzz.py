"""`tools/fuzz`: feeds the drivers and readers anything, and tells what came of it."""

from __future__ import annotations

import argparse
import os
import re
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from plumb_tools import files
from plumb_tools.arguments import whole_number
from plumb_tools.demo.pipeline import ROOT, build
from plumb_tools.demo.process import Step, StepFailed, Steps, exit_code
from plumb_tools.trajectory import InputError

BUILD = ROOT / "build" / "fuzz"
SEEDS = ROOT / "test" / "fuzz" / "corpus"
PREFIX = "fuzz_"
DEFAULT_SECONDS = 60

#: An input that takes so long does not end. By the clock, so it must not be short where other work goes on.
TIMEOUT_S = 60
DEFAULT_SEED = 1

DESCRIPTION = """\
Builds the fuzz targets of test/fuzz (clang 19 and its libFuzzer) and runs each for some seconds: what the devices send,
and the files that a user gives. An input that breaks an assertion, reads beyond its bounds or does not end is kept in
build/fuzz/findings; hand it to the program build/fuzz/bin/fuzz_... to see it again. A run begins with the inputs of
test/fuzz/corpus, which stay as they are, and with those of build/fuzz/corpus, where inputs that reach new code are kept,
so that the next run goes on from there. Needs tools/setup --fuzz. Exits with 1 when anything is found."""


@dataclass(frozen=True)
class Outcome:
    """What came of one target."""

    target: str
    executions: int
    per_second: int
    edges: int  #: of the code's branches, that any input reached
    corpus: int  #: inputs that each reach something new
    finding: str | None  #: where the input that broke it is kept, or the log of a run that left none


def targets() -> list[str]:
    """Names of what was built."""
    return sorted(path.name for path in (BUILD / "bin").glob(f"{PREFIX}*"))


def outcome_of(target: str, text: str) -> Outcome:
    """From the output of libFuzzer."""

    def last(pattern: str) -> int:
        found = re.findall(pattern, text)
        return int(found[-1]) if found else 0

    # A slow one is kept by libFuzzer too; on a busy machine any may be.
    finding = re.search(r"Test unit written to (?!\S*slow-unit-)(\S+)", text)
    return Outcome(
        target,
        last(r"stat::number_of_executed_units: (\d+)"),
        last(r"stat::average_exec_per_sec: +(\d+)"),
        last(r"cov: (\d+)"),
        last(r"corp: (\d+)/"),
        finding[1] if finding else None,
    )


def run(step: Step, target: str, seconds: int, seed: int) -> Outcome:
    """Runs one target for so long, from the inputs that are known."""
    corpus, findings = BUILD / "corpus" / target, BUILD / "findings"
    corpus.mkdir(parents=True, exist_ok=True)
    findings.mkdir(parents=True, exist_ok=True)
    seeds = [str(SEEDS / target)] if (SEEDS / target).is_dir() else []
    options = [f"-max_total_time={seconds}", f"-timeout={TIMEOUT_S}", f"-seed={seed}", "-print_final_stats=1"]
    command = [str(BUILD / "bin" / target), *options, f"-artifact_prefix={findings}/{target}-", str(corpus), *seeds]
    log = BUILD / f"{target}.log"
    failed = False
    try:
        step.run(target, command, log, lasts_s=seconds)
    except StepFailed:
        failed = True
    outcome = outcome_of(target, log.read_text(encoding="utf-8"))
    return replace(outcome, finding=str(log)) if failed and outcome.finding is None else outcome


def run_all(steps: Steps, chosen: Sequence[str], seconds: int, seed: int, jobs: int) -> list[Outcome]:
    """Runs the targets, so many side by side."""
    title = f"{len(chosen)} targets, {seconds} s each"
    with steps.step(title) as step, ThreadPoolExecutor(jobs) as workers:
        try:
            return list(workers.map(lambda target: run(step, target, seconds, seed), chosen))
        except BaseException:
            step.stop()  # else leaving the pool waits for those that run
            raise


def junit(outcomes: Sequence[Outcome]) -> str:
    """The outcomes as CTest and pytest write theirs."""
    suite = ElementTree.Element("testsuite", name="fuzz")
    for o in outcomes:
        case = ElementTree.SubElement(suite, "testcase", name=o.target)
        if o.finding is not None:
            ElementTree.SubElement(case, "failure", message=f"an input breaks it: {o.finding}")
    return ElementTree.tostring(suite, encoding="unicode")


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
    console.print(f"  seed {arguments.seed}", highlight=False)
    outcomes = run_all(steps, chosen, arguments.seconds, arguments.seed, arguments.jobs)
    console.print(_table(outcomes))
    if arguments.report is not None:
        files.write_text(arguments.report, junit(outcomes))
    if found := [f"{o.target}: {o.finding}" for o in outcomes if o.finding is not None]:
        raise StepFailed("\n".join(["an input was found that breaks", *found]))


def main(argv: Sequence[str] | None = None) -> int:
    """Fuzzes as the arguments tell; returns the exit code."""
    parser = argparse.ArgumentParser(prog="fuzz", description=DESCRIPTION)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="such as stim300_framer (default: all)")
    parser.add_argument(
        "--seconds", type=whole_number(1), default=DEFAULT_SECONDS, metavar="N", help="each (default: %(default)s)"
    )
    parser.add_argument(
        "--jobs", type=whole_number(1), default=os.cpu_count() or 1, metavar="N", help="side by side (default: %(default)s)"
    )
    parser.add_argument(
        "--seed",
        type=whole_number(1),
        default=DEFAULT_SEED,
        metavar="N",
        help="of the random changes (default: %(default)s)",
    )
    parser.add_argument("--report", type=Path, metavar="FILE", help="also write the outcomes there, as JUnit does")
    arguments = parser.parse_args(argv)
    console = Console(width=None if sys.stdout.isatty() else 120)
    return exit_code("fuzz", lambda: _fuzz(arguments, console), "the inputs found so far are kept")


if __name__ == "__main__":
    sys.exit(main())
