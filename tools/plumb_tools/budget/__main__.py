"""`tools/budget`: measures what the flight software costs and holds it against test/budget/budgets.yaml."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from plumb_tools.budget.figures import Figure, flown, instructions, replayed, sections, stacks
from plumb_tools.demo import pipeline
from plumb_tools.demo.pipeline import ROOT
from plumb_tools.demo.process import StepFailed, Steps, exit_code
from plumb_tools.files import write_text
from plumb_tools.trajectory import InputError

BUDGETS = ROOT / "test" / "budget" / "budgets.yaml"
TOLERANCE = 0.02  #: a figure that moves by more is to be looked at
IMAGES = 120

DESCRIPTION = """\
Measures memory, stack frames, stacks of the threads, heap calls and, with --arm64, instructions of the flight software,
and prints them beside their budgets. Fails when a budget is exceeded, when a figure has moved by more than 2 % since it
was last looked at, or when it has no budget. --accept keeps the new figures in test/budget/budgets.yaml."""


@dataclass(frozen=True)
class Budget:
    """What a figure may be, and what it was when it was last looked at."""

    most: float
    reviewed: float | None  #: None: it is not judged by what it was
    within: float = TOLERANCE  #: share by which it may be another


def read_budgets(file: Path) -> dict[str, Budget]:
    """Budgets by key."""
    try:
        tree = yaml.safe_load(file.read_text(encoding="utf-8"))
        return {
            key: Budget(
                float(row["most"]),
                None if row["reviewed"] is None else float(row["reviewed"]),
                float(row.get("within", TOLERANCE)),
            )
            for key, row in tree.items()
        }
    except (OSError, yaml.YAMLError, AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{file}: expected lines of KEY: {{most: NUMBER, reviewed: NUMBER or null}} ({error})") from None


def verdict(figure: Figure, budget: Budget | None) -> str | None:
    """What is wrong with a figure; None when nothing is."""
    if budget is None:
        return "has no budget"
    if figure.value > budget.most:
        return "over budget"
    if budget.reviewed is None or abs(figure.value - budget.reviewed) <= budget.within * budget.reviewed:
        return None
    return f"was {budget.reviewed:,.0f}, {100.0 * (figure.value / budget.reviewed - 1.0):+.1f} %"


def accept(figures: Sequence[Figure], file: Path) -> None:
    """Writes the figures as those that were looked at; comments and the order of the file stay."""
    values = {figure.key: figure.value for figure in figures}
    lines = []
    for line in file.read_text(encoding="utf-8").splitlines():
        key = line.split(":", 1)[0]
        if key in values and "reviewed: null" not in line:
            line = re.sub(r"reviewed: [\d.]+", f"reviewed: {values[key]:.0f}", line)
        lines.append(line)
    write_text(file, "\n".join(lines) + "\n")


def _table(figures: Sequence[Figure], budgets: dict[str, Budget]) -> Table:
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for title in ("what", "measured", "budget", "share", ""):
        table.add_column(title, justify="left" if title in ("what", "") else "right")
    for figure in figures:
        budget = budgets.get(figure.key)
        share = "-" if budget is None or budget.most == 0.0 else f"{100.0 * figure.value / budget.most:.0f} %"
        most = "-" if budget is None else f"{budget.most:,.0f}"
        wrong = verdict(figure, budget)
        table.add_row(figure.what, f"{figure.value:,.0f}", most, share, f"[red]{wrong}[/]" if wrong else "[green]ok[/]")
    return table


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="budget", description=DESCRIPTION)
    parser.add_argument("--arm64", action="store_true", help="also count instructions (tools/setup --arm64 first)")
    parser.add_argument("--accept", action="store_true", help="keep the figures as those that were looked at")
    parser.add_argument(
        "--recording", metavar="DIR", type=Path, default=ROOT.parent / "shared/data/euroc_mh01",
        help="flight for heap, memory and instructions (default: ../shared/data/euroc_mh01; without it they are left out)",
    )  # fmt: skip
    return parser


def _measure(arguments: argparse.Namespace, steps: Steps) -> list[Figure]:
    build, logs = ROOT / "build" / "flight", ROOT / "build" / "budget"
    for target in ("plumb-fsw", "plumb-replay", "test_live"):
        pipeline.build(steps, logs, target)
    figures = [*sections(build), *stacks(build)]
    with steps.step("fly for 12 s"):
        figures += flown(build)
    if not arguments.recording.is_dir():
        print(f"budget: no {arguments.recording}: heap, memory and instructions are left out", file=sys.stderr)
        return figures
    figures += replayed(arguments.recording)
    if arguments.arm64:
        for target in ("plumb-instruction-budget", "plumb-tick-budget"):
            pipeline.build(steps, logs, target, "arm64-flight")
        with steps.step("count instructions"):
            figures += instructions(ROOT / "build" / "arm64-flight", arguments.recording, IMAGES)
    return figures


def _budget(arguments: argparse.Namespace, console: Console) -> None:
    figures = _measure(arguments, Steps(console))
    budgets = read_budgets(BUDGETS)
    if arguments.accept:
        accept(figures, BUDGETS)
        budgets = read_budgets(BUDGETS)
    console.print(_table(figures, budgets))
    wrong = [figure for figure in figures if verdict(figure, budgets.get(figure.key))]
    if wrong:
        raise StepFailed(f"{len(wrong)} of {len(figures)} figures are to be looked at: mend them, or --accept and say why")


def main(argv: Sequence[str] | None = None) -> int:
    """Measures and judges; returns the exit code."""
    arguments = _parser().parse_args(argv)
    return exit_code("budget", lambda: _budget(arguments, Console(width=None if sys.stdout.isatty() else 120)), "")


if __name__ == "__main__":
    sys.exit(main())
