#!/usr/bin/env python3
"""What an image costs on 64-bit ARM, and what accuracy that buys, against the numbers of tracks, poses and features.

    build/venv/bin/python test/budget/size_curve.py [--images N] [--sizes 8x30,12x30] [--tracks 40,80] [--picture FILE] RECORDING...

Builds the flight configuration with other numbers of poses and of features in the state (POSESxFEATURES), flies the one
as shipped also with fewer tracks (tracker.max_features), and counts the instructions of each flight in the emulator
(instruction_budget.py). Prints a table and draws it. Needs tools/setup --arm64. Builds are kept in build/sizes.
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
ALL_TRACKS = 160
DEFAULT_SIZES = "4x27,4x30,8x30,12x30,16x30,12x8,12x15,12x45"
DEFAULT_TRACKS = "40,80,120"


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
    """One choice of sizes, and what the recordings gave."""

    poses: int
    features: int
    tracks: int
    flights: tuple[Flight, ...]

    @property
    def is_shipped(self) -> bool:
        """Whether it is what flies."""
        return (self.poses, self.features, self.tracks) == (*SHIPPED, ALL_TRACKS)


def build(poses: int, features: int) -> Path:
    """The folder of a build with these sizes."""
    folder = ROOT / "build" / "sizes" / f"arm64-flight-{poses}x{features}"
    sizes = [f"-DPLUMB_POSES={poses}", f"-DPLUMB_FEATURES={features}"]
    make = ["--build", str(folder), "--target", "plumb-instruction-budget"]
    for command in (["--preset", "arm64-flight", "-B", str(folder), *sizes], make):
        subprocess.run(["cmake", *command], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return folder


def fly(program: Path, name: str, recording: Path, images: int | None, tracks: int) -> Flight:
    """Counts and scores one recording."""
    with tempfile.TemporaryDirectory() as folder:
        poses = Path(folder) / "flight.tum"
        parameters = Path(folder) / "parameters.yaml"
        parameters.write_text(f"tracker:\n  max_features: {tracks}\n", encoding="utf-8")
        costs, _ = instruction_budget.count(
            program, recording, name, images, trajectory=poses, parameters=parameters
        )
        fitted = score(read_truth(recording), read_estimate(poses), Options()).score.alignments["4dof"]
    assert fitted is not None
    regions = list(instruction_budget.REGIONS.values())
    front = [regions.index(region) for region in instruction_budget.FRONT_END]
    front_end, total = costs[:, front].sum(axis=1).mean() / 1e6, costs.sum(axis=1).mean() / 1e6
    return Flight(front_end, total - front_end, 1e3 * fitted.ate_rmse_m)


def measure(size: str, tracks: int, recordings: list[Path], images: int | None) -> Point:
    """Builds one pair of sizes and flies the recordings."""
    print(f"size_curve: {size}, {tracks} tracks", file=sys.stderr)
    poses, features = map(int, size.split("x"))
    program = build(*(SHIPPED if (poses, features) == PAPER else (poses, features)))
    name = "paper" if (poses, features) == PAPER else f"flight-{poses}x{features}"
    flights = tuple(fly(program, name, recording, images, tracks) for recording in recordings)
    return Point(poses, features, tracks, flights)


def table(points: list[Point], recordings: list[Path]) -> str:
    """Markdown, a row for each choice of sizes."""
    kinds = ("front end", "filter", "whole image", "ATE [mm]")
    heads = ["poses", "features", "tracks", *(f"{recording.name}: {kind}" for recording in recordings for kind in kinds)]
    lines = ["| " + " | ".join(heads) + " |", "|" + "---:|" * len(heads)]
    for point in points:
        sizes = [str(point.poses), str(point.features), str(point.tracks)]
        cells = [f"**{size}**" for size in sizes] if point.is_shipped else sizes
        for flight in point.flights:
            cells += [f"{flight.front_end:.2f}", f"{flight.filter:.2f}", f"{flight.total:.2f}", f"{flight.ate_mm:.1f}"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw(points: list[Point], recordings: list[Path], picture: Path) -> None:
    """Cost against each size, the others as shipped, and error against the cost of the whole image."""
    figure, panels = pyplot.subplots(2, 2, figsize=(9, 6.4), layout="constrained")
    shipped = (*SHIPPED, ALL_TRACKS)
    for varied, (title, axes) in enumerate(zip(("poses", "features in the state", "tracks"), panels.flat, strict=False)):
        others = [i for i in range(len(shipped)) if i != varied]
        curve = []
        for point in points:
            sizes = (point.poses, point.features, point.tracks)
            if all(sizes[i] == shipped[i] for i in others):
                curve.append((sizes[varied], point.flights))
        curve.sort(key=lambda at: at[0])
        sizes_drawn = [size for size, _ in curve]
        for number, (recording, mark) in enumerate(zip(recordings, "os^v", strict=False)):
            of_recording = [flights[number] for _, flights in curve]
            for part, line in (("filter", "-"), ("total", "--")):
                label = f"{recording.name}: {'whole image' if part == 'total' else part}"
                axes.plot(sizes_drawn, [getattr(f, part) for f in of_recording], f"{mark}{line}C{number}", label=label)
        axes.axvline(shipped[varied], color="grey", linewidth=0.8, linestyle=":")
        axes.set(xlabel=title, ylabel="million instructions an image", xlim=(0, None), ylim=(0, None))
    by_cost = panels.flat[3]
    for number, (recording, mark) in enumerate(zip(recordings, "os^v", strict=False)):
        flights = [point.flights[number] for point in points]
        by_cost.plot([f.total for f in flights], [f.ate_mm for f in flights], f"{mark}C{number}", label=recording.name)
        for point, flight in zip(points, flights, strict=True):
            text = f"{point.poses}x{point.features}" + ("" if point.tracks == ALL_TRACKS else f", {point.tracks}")
            weight = "bold" if point.is_shipped else "normal"
            where = (flight.total, flight.ate_mm)
            by_cost.annotate(text, where, fontsize=7, weight=weight, xytext=(4, 4), textcoords="offset points")
    by_cost.set(xlabel="whole image [million instructions]", ylabel="error after alignment [mm]", ylim=(0, None))
    for axes in panels.flat:
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7)
    figure.savefig(picture)


def main() -> int:
    """Measures, prints and draws."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", type=Path, nargs="+", metavar="RECORDING")
    parser.add_argument("--images", type=int, help="of each recording (default: all)")
    parser.add_argument("--sizes", default=DEFAULT_SIZES, help="default: %(default)s")
    parser.add_argument("--tracks", default=DEFAULT_TRACKS, help="default: %(default)s")
    parser.add_argument("--picture", type=Path, default=ROOT / "docs/images/sizes.png", help="default: %(default)s")
    arguments = parser.parse_args()
    shipped = "x".join(map(str, SHIPPED))
    chosen = [(size, ALL_TRACKS) for size in arguments.sizes.split(",")]
    chosen += [(shipped, int(tracks)) for tracks in arguments.tracks.split(",")]
    points = [measure(size, tracks, arguments.recordings, arguments.images) for size, tracks in chosen]
    print(table(points, arguments.recordings))
    draw(points, arguments.recordings, arguments.picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
