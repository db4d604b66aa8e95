#!/usr/bin/env python3
"""What an image costs on 64-bit ARM, and what accuracy that buys, against the sizes of the filter's state.

    test/budget/size_curve.py [--images N] [--flights N] [--scenes A,B] [--picture FILE] RECORDING

Builds the flight configuration with other numbers of poses and of features in the state, twice: for ARM, to count the
instructions of an image of the recording (instruction_budget.py), and for this machine, to fly simulated scenes
(plumb-montecarlo). Prints a table and draws it. Needs tools/setup --arm64. Builds are kept in build/sizes.
"""

import argparse
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import instruction_budget
from matplotlib import pyplot
from plumb_tools.ablation import read_cell

ROOT = Path(__file__).parents[2]
SHIPPED = (12, 30)
POSES = (4, 8, 12, 16)
FEATURES = (10, 20, 30, 40)
DEFAULT_SCENES = "outdoor_cruise_stepped,excitation"


@dataclass(frozen=True)
class Point:
    """One pair of sizes. Instructions in millions, mean over the images; the worst axis in percent of the distance."""

    poses: int
    features: int
    front_end: float
    filter: float
    errors: tuple[float, ...]

    @property
    def total(self) -> float:
        """Of the whole image."""
        return self.front_end + self.filter


def build(poses: int, features: int, preset: str, target: str) -> Path:
    """The folder of a build with these sizes."""
    folder = ROOT / "build" / "sizes" / f"{preset}-{poses}x{features}"
    sizes = [f"-DPLUMB_POSES={poses}", f"-DPLUMB_FEATURES={features}", "-DBUILD_TESTING=OFF"]
    for command in (["--preset", preset, "-B", str(folder), *sizes], ["--build", str(folder), "--target", target]):
        subprocess.run(["cmake", *command], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return folder


def error_of(program: Path, scene: str, flights: int) -> float:
    """Of flights with the range finder, started without truth."""
    table = program.parent / f"{scene}.csv"
    command = [program, "--scene", scene, "--seeds", str(flights), "--no-vio", "--csv", table]
    subprocess.run([*command, "--jobs", str(os.cpu_count() or 1)], check=True, capture_output=True)
    return read_cell(table).axis_percent or float("nan")


def measure(poses: int, features: int, scenes: list[str], arguments: argparse.Namespace) -> Point:
    """Builds, counts and flies one pair of sizes."""
    print(f"size_curve: {poses} poses, {features} features", file=sys.stderr)
    arm = build(poses, features, "arm64-flight", "plumb-instruction-budget")
    costs, _ = instruction_budget.count(arm, arguments.recording, f"flight-{poses}x{features}", arguments.images)
    names = list(instruction_budget.REGIONS.values())
    front_end = costs[:, [names.index(name) for name in instruction_budget.FRONT_END]].sum(axis=1).mean() / 1e6
    program = build(poses, features, "flight", "plumb-montecarlo") / "bin" / "plumb-montecarlo"
    errors = tuple(error_of(program, scene, arguments.flights) for scene in scenes)
    return Point(poses, features, front_end, costs.sum(axis=1).mean() / 1e6 - front_end, errors)


def table(points: list[Point], scenes: list[str]) -> str:
    """Markdown, a row for each pair of sizes."""
    heads = ["poses", "features", "front end", "filter", "whole image", *(f"{scene} [%]" for scene in scenes)]
    lines = ["| " + " | ".join(heads) + " |", "|" + "---:|" * len(heads)]
    for point in points:
        values = [f"{value:.2f}" for value in (point.front_end, point.filter, point.total)]
        errors = [f"{error:.3f}" for error in point.errors]
        lines.append("| " + " | ".join([str(point.poses), str(point.features), *values, *errors]) + " |")
    return "\n".join(lines)


def draw(points: list[Point], scenes: list[str], picture: Path) -> None:
    """Cost against each size, the other as shipped, and error against cost."""
    figure, (by_size, by_cost) = pyplot.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
    along_poses = [point for point in points if point.features == SHIPPED[1]]
    along_features = [point for point in points if point.poses == SHIPPED[0]]
    by_size.plot([p.poses for p in along_poses], [p.filter for p in along_poses], "o-", label="poses, of 30 features")
    by_size.plot([p.features for p in along_features], [p.filter for p in along_features], "s-",
                 label="features, with 12 poses")  # fmt: skip
    by_size.set(xlabel="poses or features", ylabel="filter [million instructions an image]", ylim=(0, None))
    for number, scene in enumerate(scenes):
        by_cost.plot([p.total for p in points], [p.errors[number] for p in points], "o", label=scene)
    for point in points:
        by_cost.annotate(f"{point.poses}x{point.features}", (point.total, max(point.errors)), fontsize=7,
                         xytext=(3, 3), textcoords="offset points")  # fmt: skip
    by_cost.set(xlabel="whole image [million instructions]", ylabel="worst axis [% of distance]", ylim=(0, None))
    for axes in (by_size, by_cost):
        axes.grid(alpha=0.3)
        axes.legend()
    figure.savefig(picture)


def main() -> int:
    """Measures, prints and draws."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--images", type=int, default=120, help="of the recording (default: %(default)s)")
    parser.add_argument("--flights", type=int, default=10, help="per scene (default: %(default)s)")
    parser.add_argument("--scenes", default=DEFAULT_SCENES, help="default: %(default)s")
    parser.add_argument("--picture", type=Path, default=ROOT / "docs/images/sizes.svg", help="default: %(default)s")
    arguments = parser.parse_args()
    scenes = arguments.scenes.split(",")
    sizes = sorted({(poses, SHIPPED[1]) for poses in POSES} | {(SHIPPED[0], features) for features in FEATURES})
    points = [measure(poses, features, scenes, arguments) for poses, features in sizes]
    print(table(points, scenes))
    draw(points, scenes, arguments.picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
