#!/usr/bin/env python3
"""The kernels that fly against OpenCV's, on whole flights: time, heap calls and error.

    test/budget/tracker_comparison.py [--rounds N] [--build build/flight] RECORDING...

Flies each recording with plumb-replay and with plumb-replay-opencv, which differ in the image kernels alone, in turn
and as often as --rounds says. Of an image's times the shortest of the rounds counts: what else the machine does only
adds to them. Where it is allowed to, it runs before everything else, on one processor.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from plumb_tools.report.headline import headline_of
from plumb_tools.report.run import Run, read_run
from plumb_tools.trajectory import read_truth

ROOT = Path(__file__).parents[2]
PROGRAMS = {"own kernels": "plumb-replay", "OpenCV's kernels": "plumb-replay-opencv"}
STAGES = ("front end", "filter", "whole image")


def fly(program: Path, recording: Path, out: Path) -> Run:
    """One replay."""
    command = [str(program), "--asl", str(recording), "--out", str(out)]
    subprocess.run(command, check=True, capture_output=True, text=True)
    return read_run(out, program.name)


def times_ms(run: Run) -> np.ndarray:
    """A row for each image, a column for each of STAGES."""
    stages = {stage: run.timing[f"{stage}_us"] for stage in run.stages}
    front_end = stages.pop("front_end")
    filtering = np.sum(list(stages.values()), axis=0)
    return np.column_stack([front_end, filtering, front_end + filtering]) / 1e3


def heap_calls_per_image(run: Run) -> float:
    """In estimator and tracker."""
    calls = run.summary["heap_calls"]
    return (calls["estimator"] + calls["tracker"]) / run.summary["images_processed"]


def compare(recording: Path, programs: Path, rounds: int) -> list[str]:
    """Rows of the table for one recording."""
    runs: dict[str, Run] = {}
    best: dict[str, np.ndarray] = {}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(rounds):
            for name, program in PROGRAMS.items():
                runs[name] = fly(programs / program, recording, Path(folder) / program)
                times = times_ms(runs[name])
                best[name] = np.minimum(best.get(name, times), times)
        truth = read_truth(recording)
        ratio = best["own kernels"].mean(axis=0) / best["OpenCV's kernels"].mean(axis=0)
        rows = []
        for name, run in runs.items():
            cells = [f"{column.mean():.2f}, {np.median(column):.2f}, {column.max():.1f}" for column in best[name].T]
            headline, _ = headline_of(truth, run)
            error = f"{1e3 * headline.ate_m:.1f}"
            rows.append(f"| {recording.name} | {name} | {' | '.join(cells)} | {heap_calls_per_image(run):.0f} | {error} |")
        rows.append(f"| | ratio of the means | {' | '.join(f'{value:.2f}' for value in ratio)} | | |")
    return rows


def go_first() -> None:
    """One processor, and before others where that is allowed."""
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
    except PermissionError:
        print("tracker_comparison: not allowed to run before others; times are those of a shared machine", file=sys.stderr)


def main() -> int:
    """Compares and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", type=Path, nargs="+", metavar="RECORDING")
    parser.add_argument("--rounds", type=int, default=3, help="default: %(default)s")
    parser.add_argument("--build", type=Path, default=ROOT / "build/flight", help="default: %(default)s")
    arguments = parser.parse_args()
    go_first()
    print(f"| flight | kernels | {' | '.join(f'{stage} [ms]' for stage in STAGES)} | heap calls an image | ATE [mm] |")
    print(f"|---|---|{'---|' * len(STAGES)}---:|---:|")
    for recording in arguments.recordings:
        print("\n".join(compare(recording, arguments.build / "bin", arguments.rounds)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
