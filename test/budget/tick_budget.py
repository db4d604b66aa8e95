#!/usr/bin/env python3
"""What a tick of the executive costs on 64-bit ARM, in instructions.

    test/budget/tick_budget.py [--build build/arm64-flight] [--images N] RECORDING

Flies a recording with plumb-tick-budget in qemu-user under the plugin instruction_trace.c, a tick for each IMU sample.
The counts are exact and the same in every run.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from instruction_budget import ROOT, images_of, trace_of

REGIONS = {20: "tick"}


def count(build: Path, recording: Path, images: int | None) -> np.ndarray:
    """Instructions of every tick, of those that come with the first images."""
    command = ["plumb-tick-budget", str(recording)]
    if images is not None:
        command.append(str(images))
    _, trace, _ = trace_of(build, command)
    return np.array([tick["tick"] for tick in images_of(trace, REGIONS)])


def main() -> int:
    """Counts and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--build", type=Path, default=ROOT / "build/arm64-flight")
    parser.add_argument("--images", type=int, help="stop after so many")
    arguments = parser.parse_args()
    ticks = count(arguments.build, arguments.recording, arguments.images)
    print(f"{len(ticks)} ticks, thousands of instructions\n\n| mean | median | 99 % | largest |\n|---|---|---|---|")
    figures = (ticks.mean(), np.median(ticks), np.percentile(ticks, 99), ticks.max())
    print("| " + " | ".join(f"{figure / 1e3:.1f}" for figure in figures) + " |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
