"""`tools/ablation`: the same simulated flights with one feature of the estimator off at a time, as a table."""

from __future__ import annotations

import argparse
import csv
import os
import statistics
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from plumb_tools import files
from plumb_tools.arguments import whole_number
from plumb_tools.demo import pipeline
from plumb_tools.demo.pipeline import ROOT
from plumb_tools.demo.process import Steps, exit_code

PROGRAM = ROOT / "build" / "flight" / "bin" / "plumb-montecarlo"
DEFAULT_SCENES = "outdoor_cruise_stepped,hover,descent,vertical_descent,excitation"
DEFAULT_SEEDS = 10
DEFAULT_OUT = Path("docs/ablation.md")
DEFAULT_WORK = Path("build/ablation")

DESCRIPTION = """\
Flies simulated scenes (plumb-montecarlo --help names them) as shipped and with one feature of the estimator off, or
on that is off as shipped, with the same seeds, and writes one table of errors and consistency. With its
defaults it takes three quarters of an hour of one processor."""

INTRODUCTION = """\
# What each feature brings

The same simulated flights, once as shipped and once with one thing changed. The tracker is simulated too; the filter
knows the noise of the simulation. In each cell: the worst axis in percent of the distance, the error of scale in
percent (Sim3), and in brackets the NEES of position at the end of the flight, ideally 3; all are means over
{seeds} flights, of signed figures the size counts.{bounds} A dash: no flight had a solution.
"""


@dataclass(frozen=True)
class Variant:
    """One way to fly."""

    name: str
    settings: tuple[str, ...] = ()  #: parameters of the filter
    options: tuple[str, ...] = ()  #: of plumb-montecarlo: what else the flight or the filter has


OUTLIERS = ("--outliers", "0.05", "--range-outliers", "0.05")

VARIANTS = (
    Variant("as shipped"),
    Variant("no ranged features: facets only", ("range.feature=0",)),
    Variant("no facets: ranged features only", ("range.facet=0",)),
    Variant("both at once", ("range.facet_after=0",)),
    Variant("facets taken for flat, as in the paper", ("range.feature=0", "range.relief=0")),
    Variant("new features not at the depth of the range", ("range.depth_prior=0",)),
    Variant("no ranges", ("range.enabled=0",)),
    Variant("no start in motion", ("start.in_motion=0",)),
    Variant("features do not wait for the scale", ("vision.slam_velocity_sigma=1000",)),
    Variant("six features around the laser's spot", ("vision.spot_features=6",)),
    Variant("the same with facets only", ("range.feature=0", "vision.spot_features=6")),
    Variant("standstill not seen", ("start.still_image=0.01",)),
    Variant("the paper's 4 poses and 27 features", (), ("--config", "paper")),
    Variant("every pose stays", ("vision.pose_interval=0",)),
    Variant("visual gate at 95 %", ("vision.gate_probability=0.95",)),
    Variant("pixel noise of 1 px, twice what it is", ("vision.pixel_noise=1",)),
    Variant("the same, followed in flight", ("vision.pixel_noise=1", "vision.pixel_noise_images=100")),
    Variant("one observation and one range in twenty wrong", (), OUTLIERS),
    Variant("the same without gates", ("vision.gate_probability=0.999999", "range.gate_sigma=100"), OUTLIERS),
    Variant("sensors not calibrated", (), ("--uncalibrated",)),
    Variant("the same, estimated in flight", ("range.facet=0",), ("--uncalibrated", "--config", "calibrating")),
    Variant("a sun sensor", (), ("--sun-rate", "5", "--sun-noise", "0.01")),
    Variant("a magnetometer", (), ("--magnetometer-rate", "5", "--magnetometer-noise", "0.03")),
)


@dataclass(frozen=True)
class Cell:
    """One scene flown in one way; None where no flight has the figure."""

    axis_percent: float | None
    scale_percent: float | None
    nees_position: float | None
    diverged: int
    absent: int = 0  #: flights that never had a state

    def text(self) -> str:
        """As the table shows it."""
        if self.axis_percent is None:
            return "-"
        scale = "-" if self.scale_percent is None else f"{self.scale_percent:.3f}"
        nees = "-" if self.nees_position is None else f"{self.nees_position:.1f}"
        lost = f", {self.diverged} diverged" if self.diverged else ""
        absent = f", {self.absent} never started" if self.absent else ""
        return f"{self.axis_percent:.2f}, {scale} ({nees}){lost}{absent}"


def read_cell(file: Path) -> Cell:
    """The figures of the flights in a table of plumb-montecarlo."""
    with file.open(encoding="utf-8", newline="") as stream:
        flights = list(csv.DictReader(stream))
    rows = [row for row in flights if row["started"] == "1"]

    def mean(column: str) -> float | None:
        sizes = [abs(value) for row in rows if (value := float(row[column])) == value]
        return statistics.mean(sizes) if sizes else None

    diverged = sum(row["diverged"] == "1" for row in rows)
    absent = len(flights) - len(rows)
    return Cell(mean("worst_axis_percent"), mean("sim3_scale_percent"), mean("nees_position_100"), diverged, absent)


def fly(steps: Steps, scene: str, variant: Variant, seeds: int, work: Path) -> Cell:
    """Flies one scene in one way."""
    table = work / f"{scene}-{VARIANTS.index(variant)}.csv"
    command: list[str | Path] = [PROGRAM, "--scene", scene, "--seeds", str(seeds), "--no-vio", "--csv", table]
    command += variant.options
    for setting in variant.settings:
        command += ["--set", setting]
    title = f"{scene}, {variant.name}"
    with steps.step(title) as step:
        step.run(title, [*command, "--jobs", str(os.cpu_count() or 1)], table.with_suffix(".log"))
    return read_cell(table)


def markdown(scenes: Sequence[str], cells: Sequence[Sequence[Cell]], seeds: int, command: str) -> str:
    """The page: a row for each variant, a column for each scene."""
    bounds = " 1.7 to 4.7 is expected of ten." if seeds == DEFAULT_SEEDS else ""
    lines = [INTRODUCTION.format(seeds=seeds, bounds=bounds)]
    lines += ["| flown | " + " | ".join(scenes) + " |", "|---|" + "---|" * len(scenes)]
    for variant, row in zip(VARIANTS, cells, strict=True):
        setting = "".join(f" `{text}`" for text in (" ".join(variant.options), *variant.settings) if text)
        lines.append(f"| {variant.name}{setting} | " + " | ".join(cell.text() for cell in row) + " |")
    return "\n".join([*lines, "", f"    {command}", ""])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="ablation", description=DESCRIPTION)
    parser.add_argument("--scenes", metavar="A,B", default=DEFAULT_SCENES, help="default: %(default)s")
    parser.add_argument("--seeds", metavar="N", type=whole_number(1, 1000), default=DEFAULT_SEEDS, help="default: 10")
    parser.add_argument("--out", metavar="FILE", type=Path, default=ROOT / DEFAULT_OUT, help=f"default: {DEFAULT_OUT}")
    parser.add_argument("--work", metavar="DIR", type=Path, default=ROOT / DEFAULT_WORK, help="tables and logs")
    return parser


def _ablation(arguments: argparse.Namespace, console: Console) -> None:
    steps = Steps(console)
    scenes = arguments.scenes.split(",")
    files.expect_file(arguments.out, "--out")
    files.expect_folder(arguments.work, "--work")
    pipeline.build(steps, arguments.work, "plumb-montecarlo")
    cells = [[fly(steps, scene, variant, arguments.seeds, arguments.work) for scene in scenes] for variant in VARIANTS]
    chosen = "" if arguments.scenes == DEFAULT_SCENES else f" --scenes {arguments.scenes}"
    files.write_text(
        arguments.out, markdown(scenes, cells, arguments.seeds, f"tools/ablation{chosen} --seeds {arguments.seeds}")
    )
    console.print(f"ablation: {arguments.out}", highlight=False, soft_wrap=True)


def main(argv: Sequence[str] | None = None) -> int:
    """Flies as the arguments tell; returns the exit code."""
    arguments = _parser().parse_args(argv)
    return exit_code("ablation", lambda: _ablation(arguments, Console()), "what it had flown is lost")


if __name__ == "__main__":
    sys.exit(main())
