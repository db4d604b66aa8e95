#!/usr/bin/env python3
"""What an image costs on 64-bit ARM, and what accuracy that buys, against the sizes of the filter's state.

    test/budget/size_curve.py [--images N] [--sizes 8x30,12x30] [--picture FILE] RECORDING...

Builds the flight configuration with other numbers of poses and of features in the state (POSESxFEATURES) and flies the
recordings with it in the emulator, counting instructions (instruction_budget.py). Prints a table and draws it. Needs
tools/setup --arm64. Builds are kept in build/sizes.
"""

import argparse
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import instruction_budget
import numpy as np
from matplotlib import pyplot
from plumb_tools.score.compute import Options, score
from plumb_tools.score.estimate import read_estimate
from plumb_tools.trajectory import read_truth

ROOT = Path(__file__).parents[2]
SHIPPED = (12, 30)
PAPER = (4, 27)  # in every build, as the configuration of that name
DEFAULT_SIZES = "4x27,8x30,12x15,12x30,16x30"


@dataclass(frozen=True)
class Flight:
    """One recording. Millions of instructions, mean over the images, and the error after alignment."""

    front_end: float
    filter: float
    ate_mm: float

    @property
    def total(self) -> float:
        """Of the whole image."""
        return self.front_end + self.filter


@dataclass(frozen=True)
class Point:
    """One pair of sizes, and what the recordings gave."""

    poses: int
    features: int
    flights: tuple[Flight, ...]


def build(poses: int, features: int) -> Path:
    """The folder of a build with these sizes."""
    folder = ROOT / "build" / "sizes" / f"arm64-flight-{poses}x{features}"
    sizes = [f"-DPLUMB_POSES={poses}", f"-DPLUMB_FEATURES={features}"]
    make = ["--build", str(folder), "--target", "plumb-instruction-budget"]
    for command in (["--preset", "arm64-flight", "-B", str(folder), *sizes], make):
        subprocess.run(["cmake", *command], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return folder


def fly(program: Path, name: str, recording: Path, images: int | None) -> Flight:
    """Counts and scores one recording."""
    with tempfile.TemporaryDirectory() as folder:
        poses = Path(folder) / "flight.tum"
        costs, _ = instruction_budget.count(program, recording, name, images, trajectory=poses)
        fitted = score(read_truth(recording), read_estimate(poses), Options()).score.alignments["4dof"]
    assert fitted is not None
    regions = list(instruction_budget.REGIONS.values())
    front = [regions.index(region) for region in instruction_budget.FRONT_END]
    front_end, total = costs[:, front].sum(axis=1).mean() / 1e6, costs.sum(axis=1).mean() / 1e6
    return Flight(front_end, total - front_end, 1e3 * fitted.ate_rmse_m)


def measure(size: str, recordings: list[Path], images: int | None) -> Point:
    """Builds one pair of sizes and flies the recordings."""
    print(f"size_curve: {size}", file=sys.stderr)
    poses, features = map(int, size.split("x"))
    program = build(*(SHIPPED if (poses, features) == PAPER else (poses, features)))
    name = "paper" if (poses, features) == PAPER else f"flight-{poses}x{features}"
    return Point(poses, features, tuple(fly(program, name, recording, images) for recording in recordings))


def table(points: list[Point], recordings: list[Path]) -> str:
    """Markdown, a row for each pair of sizes."""
    kinds = ("front end", "filter", "whole image", "ATE [mm]")
    heads = ["poses", "features", *(f"{recording.name}: {kind}" for recording in recordings for kind in kinds)]
    lines = ["| " + " | ".join(heads) + " |", "|" + "---:|" * len(heads)]
    for point in points:
        cells = [str(point.poses), str(point.features)]
        for flight in point.flights:
            cells += [f"{flight.front_end:.2f}", f"{flight.filter:.2f}", f"{flight.total:.2f}", f"{flight.ate_mm:.1f}"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw(points: list[Point], recordings: list[Path], picture: Path) -> None:
    """Cost of the filter against each size, the other as shipped, and error against the cost of the whole image."""
    figure, (by_size, by_cost) = pyplot.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    states = [15 + 6 * point.poses + 3 * point.features for point in points]
    for number, (recording, mark) in enumerate(zip(recordings, "os^v", strict=False)):
        flights = [point.flights[number] for point in points]
        order = np.argsort(states)
        name = recording.name
        by_size.plot(np.array(states)[order], [flights[i].filter for i in order], mark + "-", label=name)
        by_cost.plot([flight.total for flight in flights], [flight.ate_mm for flight in flights], mark, label=name)
        for point, state, flight in zip(points, states, flights, strict=True):
            bold = "bold" if (point.poses, point.features) == SHIPPED else "normal"
            text = f"{point.poses}x{point.features}"
            for axes, where in ((by_size, (state, flight.filter)), (by_cost, (flight.total, flight.ate_mm))):
                axes.annotate(text, where, fontsize=7, weight=bold, xytext=(4, 4), textcoords="offset points")
    by_size.set(xlabel="states", ylabel="filter [million instructions an image]", ylim=(0, None))
    by_cost.set(xlabel="whole image [million instructions]", ylabel="error after alignment [mm]", ylim=(0, None))
    for axes in (by_size, by_cost):
        axes.grid(alpha=0.3)
        axes.legend()
    figure.savefig(picture)


def main() -> int:
    """Measures, prints and draws."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", type=Path, nargs="+", metavar="RECORDING")
    parser.add_argument("--images", type=int, help="of each recording (default: all)")
    parser.add_argument("--sizes", default=DEFAULT_SIZES, help="default: %(default)s")
    parser.add_argument("--picture", type=Path, default=ROOT / "docs/images/sizes.png", help="default: %(default)s")
    arguments = parser.parse_args()
    points = [measure(size, arguments.recordings, arguments.images) for size in arguments.sizes.split(",")]
    print(table(points, arguments.recordings))
    draw(points, arguments.recordings, arguments.picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
