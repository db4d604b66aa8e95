#!/usr/bin/env python3
"""What an image costs on 64-bit ARM, in instructions, stage by stage.

    build/venv/bin/python test/budget/instruction_budget.py [--build build/arm64-flight] [--config flight] [--images N] [--csv FILE]
                                      [--functions MILLIONS] RECORDING

Flies a recording with plumb-instruction-budget in qemu-user under the plugin instruction_trace.c. The counts are exact
and the same in every run. Images before the filter has started are left out.
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]

# The regions of instruction_mark.h.
REGIONS = {
    17: "pyramid",
    18: "flow",
    19: "detect",
    0: "rest of the front end",
    1: "start",
    2: "propagation",
    3: "range",
    4: "visual rows",
    5: "visual update",
    16: "rest of the step",
}
FRONT_END = ("pyramid", "flow", "detect", "rest of the front end")
END_OF_IMAGE = 31


def images_of(trace: Iterable[str], regions: dict[int, str]) -> Iterator[dict[str, int]]:
    """Instructions per region and image out of "tag count" lines; an instruction counts for the innermost region."""
    open_regions: list[int] = []
    costs = dict.fromkeys(regions.values(), 0)
    before = 0
    for line in trace:
        tag, count = map(int, line.split())
        region, ends = divmod(tag, 2)
        if open_regions:
            costs[regions[open_regions[-1]]] += count - before
        before = count
        if region == END_OF_IMAGE:
            yield costs
            costs = dict.fromkeys(regions.values(), 0)
        elif ends:
            if not open_regions or open_regions.pop() != region:
                raise ValueError(f"region {region} ends and was not open")
        else:
            open_regions.append(region)


def plugin(build: Path) -> Path:
    """The plugin, built when it is not there or older than its source."""
    source = Path(__file__).with_name("instruction_trace.c")
    library = build / "libinstruction_trace.so"
    if not library.exists() or library.stat().st_mtime < source.stat().st_mtime:
        subprocess.run(["cc", "-O2", "-fPIC", "-shared", str(source), "-o", str(library)], check=True)
    return library


def functions_of(lines: Iterable[str], images: int, least: float) -> str:
    """The functions that cost at least so many millions of instructions an image; those of the start are left out."""
    rows = []
    for line in lines:
        region, cost, symbol = line.split(maxsplit=2)
        if REGIONS[int(region)] != "start":
            rows.append((REGIONS[int(region)], int(cost) / images / 1e6, symbol.strip()))
    rows = sorted((row for row in rows if row[1] >= least), key=lambda row: -row[1])
    names = subprocess.run(["c++filt", "-p"], input="\n".join(row[2] for row in rows), capture_output=True, text=True)
    lines = ["| stage | function | mean |", "|---|---|---|"]
    for (region, cost, _), name in zip(rows, names.stdout.splitlines(), strict=True):
        lines.append(f"| {region} | `{name.replace('plumb::', '')[:70]}` | {cost:.2f} |")
    return "\n".join(lines)


def emulator_of(program: Path) -> list[str]:
    """For the processor that the program is built for, by the header of its ELF file."""
    elf_machine_at = 18
    aarch64 = 183
    with program.open("rb") as file:
        file.seek(elf_machine_at)
        machine = int.from_bytes(file.read(2), "little")
    if machine == aarch64:
        return ["qemu-aarch64", "-L", str(ROOT / "build/sysroot-arm64")]
    return ["qemu-x86_64", "-cpu", "max"]


def trace_of(build: Path, command: list[str], functions: bool = False) -> tuple[str, list[str], list[str]]:
    """What a program of the build prints when it runs in the emulator, its marks, and the functions if wanted."""
    with tempfile.TemporaryDirectory() as folder:
        trace = Path(folder) / "trace"
        by_function = Path(folder) / "functions"
        options = f"{plugin(build)},out={trace}" + (f",functions={by_function}" if functions else "")
        program = [str(build / "bin" / command[0]), *command[1:]]
        emulator = [*emulator_of(Path(program[0])), "-plugin", options]
        out = subprocess.run(emulator + program, check=True, capture_output=True, text=True).stdout
        lines = trace.read_text().splitlines()
        return out, lines, by_function.read_text().splitlines() if functions else []


def count(
    build: Path,
    recording: Path,
    config: str,
    images: int | None,
    least: float | None = None,
    trajectory: Path | None = None,
    parameters: Path | None = None,
) -> tuple[np.ndarray, str]:
    """One row per image that the running filter processed, one column per region; and, if asked, the functions.

    The poses of the flight are written to `trajectory`, a TUM file. `parameters` is a YAML file.
    """
    command = ["plumb-instruction-budget", str(recording), config, str(images or sys.maxsize)]
    if parameters is not None:
        command.append(str(parameters))
    out, trace, by_function = trace_of(build, command, functions=least is not None)
    costs = [list(image.values()) for image in images_of(trace, REGIONS)]
    functions = "" if least is None else functions_of(by_function, len(costs), least)
    states = [line.split(maxsplit=1) for line in out.splitlines()]
    valid = [flag == "1" for flag, _ in states]
    if trajectory is not None:
        trajectory.write_text("".join(f"{pose}\n" for flag, pose in states if flag == "1"), encoding="utf-8")
    # The image that the filter starts with is judged by other means than those that follow.
    running = [now and before for now, before in zip(valid, [False, *valid[:-1]], strict=True)]
    return np.array(costs)[np.array(running)], functions


def table(costs: np.ndarray) -> str:
    """Mean, median and largest count per region and in total, in millions."""
    names = list(REGIONS.values())
    front_end = costs[:, [names.index(name) for name in FRONT_END]].sum(axis=1)
    total = costs.sum(axis=1)
    rows = [(name, costs[:, i]) for i, name in enumerate(names)]
    rows += [("front end", front_end), ("filter", total - front_end), ("whole image", total)]
    lines = [f"{len(costs)} images, millions of instructions", "", "| stage | mean | median | largest |", "|---|---|---|---|"]
    for name, values in rows:
        mean, median, most = (f"{value / 1e6:.2f}" for value in (values.mean(), np.median(values), values.max()))
        lines.append(f"| {name} | {mean} | {median} | {most} |")
    return "\n".join(lines)


def main() -> int:
    """Counts and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--build", type=Path, default=ROOT / "build/arm64-flight")
    parser.add_argument("--config", default="flight")
    parser.add_argument("--images", type=int, help="stop after so many")
    parser.add_argument("--csv", type=Path, help="also write the counts of every image")
    parser.add_argument("--functions", type=float, metavar="MILLIONS", help="also those that cost that much an image")
    arguments = parser.parse_args()
    costs, functions = count(
        arguments.build, arguments.recording, arguments.config, arguments.images, arguments.functions
    )
    if arguments.csv is not None:
        np.savetxt(arguments.csv, costs, fmt="%d", delimiter=",", header=",".join(REGIONS.values()))
    print(table(costs))
    if functions:
        print(f"\n{functions}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
