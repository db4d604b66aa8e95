#!/usr/bin/env python3
"""What the executive costs on 64-bit ARM, in instructions: a tick, and each job of the schedule.

    build/venv/bin/python test/budget/tick_budget.py [--build build/arm64-flight] [--images N] RECORDING

Flies a recording with plumb-tick-budget in qemu-user under the plugin instruction_trace.c, a tick for each IMU sample.
The counts are exact and the same in every run.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from instruction_budget import ROOT, images_of, trace_of

# The regions of instruction_mark.h.
TICK, FIRST_JOB = 20, 21
WHOLE_TICK, REST_OF_TICK = "whole tick", "rest of the tick"
NAV = "nav"  #: the one job that is not of the tick


def count(build: Path, recording: Path, images: int | None) -> dict[str, np.ndarray]:
    """Instructions of every tick, of those that come with the first images, and of every run of each job in which there
    was something to do. A run of the nav job is all that its thread does from image to image.
    """
    command = ["plumb-tick-budget", str(recording)]
    if images is not None:
        command.append(str(images))
    out, trace, _ = trace_of(build, command)
    jobs, *with_image = out.splitlines()
    regions = {TICK: REST_OF_TICK, **dict(enumerate(jobs.split(), FIRST_JOB))}
    ticks = list(images_of(trace, regions))
    nav = np.array([tick[NAV] for tick in ticks])
    return {
        WHOLE_TICK: np.array([sum(tick.values()) for tick in ticks]) - nav,
        **{name: np.array([tick[name] for tick in ticks if tick[name] > 0]) for name in regions.values()},
        NAV: np.add.reduceat(nav, [int(tick) for tick in with_image]),
    }


def main() -> int:
    """Counts and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--build", type=Path, default=ROOT / "build/arm64-flight")
    parser.add_argument("--images", type=int, help="stop after so many")
    arguments = parser.parse_args()
    costs = count(arguments.build, arguments.recording, arguments.images)
    print("Thousands of instructions\n\n| | runs | mean | median | 99 % | largest |\n|---|---:|---:|---:|---:|---:|")
    for what, runs in costs.items():
        figures = (runs.mean(), np.median(runs), np.percentile(runs, 99), runs.max())
        print(f"| {what} | {len(runs)} | " + " | ".join(f"{figure / 1e3:.1f}" for figure in figures) + " |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
