#!/usr/bin/env python3
"""The kernels that fly against OpenCV's, on whole flights: time of every stage, tracks kept, heap calls and error.

    build/venv/bin/python test/budget/tracker_comparison.py [--rounds N] [--build build/flight] RECORDING...

Flies each recording with plumb-replay and with plumb-replay-opencv, which differ in the image kernels alone, in turn
and as often as --rounds says. Of an image's times the shortest of the rounds counts: what else the machine does only
adds to them. Then --draws flights more each, in which tracker.min_distance differs by a pixel or two, so that other
features are followed: of the error the mean over all of them is told, the smallest and the largest. Where it is allowed
to, it runs before everything else, on one processor.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from plumb_tools.demo.process import StepFailed
from plumb_tools.report.headline import headline_of
from plumb_tools.report.run import Run, read_run
from plumb_tools.trajectory import read_truth

ROOT = Path(__file__).parents[2]
PROGRAMS = {"own kernels": "plumb-replay", "OpenCV's kernels": "plumb-replay-opencv"}
OTHER_DISTANCES_PX = (15, 17, 14, 18, 13, 19)  # shipped is 16
WHOLE = ("front end", "filter", "whole image")


def replay(program: Path, recording: Path, out: Path, parameters: str = "") -> None:
    """One flight, with parameters as YAML; its last words when it fails."""
    file = out.with_suffix(".yaml")
    file.write_text(parameters or "{}", encoding="utf-8")
    command = [str(program), "--asl", str(recording), "--out", str(out), "--params", str(file)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode != 0:
        raise StepFailed(f"{recording}: {program} ended with {done.returncode}:\n{done.stderr.strip()}")


def fly(program: Path, recording: Path, out: Path, parameters: str = "") -> Run:
    """The same, and what it wrote."""
    replay(program, recording, out, parameters)
    return read_run(out, program.name)


def times_ms(run: Run) -> dict[str, np.ndarray]:
    """Of every image, by stage; those of WHOLE are sums."""
    stages = {stage: run.timing[f"{stage}_us"] / 1e3 for stage in run.stages}
    front_end = stages.pop("front_end")
    filtering = np.sum(list(stages.values()), axis=0)
    whole = dict(zip(WHOLE, (front_end, filtering, front_end + filtering), strict=True))
    return {stage.replace("_", " "): times for stage, times in stages.items()} | whole


def tracks(run: Run) -> tuple[float, float]:
    """Tracks in an image, and images that a track lasts."""
    ids = np.loadtxt(run.folder / "features.csv", delimiter=",", skiprows=1, usecols=2, dtype=np.int64)
    return len(ids) / run.summary["images_processed"], len(ids) / len(np.unique(ids))


def heap_calls_per_image(run: Run) -> float:
    """In estimator and tracker."""
    calls = run.summary["heap_calls"]
    return (calls["estimator"] + calls["tracker"]) / run.summary["images_processed"]


def compare(recording: Path, programs: Path, rounds: int, draws: int) -> tuple[list[str], list[str]]:
    """Rows of the two tables for one recording: what flew, and its stages."""
    runs: dict[str, Run] = {}
    best: dict[str, dict[str, np.ndarray]] = {}
    errors_mm: dict[str, list[float]] = {name: [] for name in PROGRAMS}
    truth = read_truth(recording)
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(rounds):
            for name, program in PROGRAMS.items():
                runs[name] = fly(programs / program, recording, Path(folder) / program)
                times = times_ms(runs[name])
                before = best.get(name, times)
                best[name] = {stage: np.minimum(before[stage], times[stage]) for stage in times}
        kept = {name: tracks(run) for name, run in runs.items()}
        for name, program in PROGRAMS.items():
            others = (
                fly(programs / program, recording, Path(folder) / "draw", f"tracker:\n  min_distance: {distance_px}\n")
                for distance_px in OTHER_DISTANCES_PX[:draws]
            )
            errors_mm[name] += [1e3 * headline_of(truth, run)[0].ate_m for run in (runs[name], *others)]
    flights = []
    for name, run in runs.items():
        means = " | ".join(f"{best[name][stage].mean():.2f}" for stage in WHOLE)
        count, life = kept[name]
        errors = errors_mm[name]
        error = f"{np.mean(errors):.1f} ({min(errors):.1f} to {max(errors):.1f})"
        rest = f"{heap_calls_per_image(run):.0f} | {count:.0f} | {life:.1f} | {error}"
        flights.append(f"| {recording.name} | {name} | {means} | {rest} |")
    own, other = (best[name] for name in PROGRAMS)
    ratios = " | ".join(f"{own[stage].mean() / other[stage].mean():.2f}" for stage in WHOLE)
    flights.append(f"| | ratio | {ratios} | | | | |")
    stages = []
    for stage in own:
        cells = [f"{np.median(all_of[stage]):.2f} | {all_of[stage].max():.2f}" for all_of in (own, other)]
        stages.append(f"| {recording.name} | {stage} | {' | '.join(cells)} |")
    return flights, stages


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
    parser.add_argument("--rounds", type=int, default=5, help="default: %(default)s")
    parser.add_argument("--draws", type=int, default=4, help="default: %(default)s", choices=range(len(OTHER_DISTANCES_PX) + 1))
    parser.add_argument("--build", type=Path, default=ROOT / "build/flight", help="default: %(default)s")
    arguments = parser.parse_args()
    go_first()
    means = " | ".join(f"{stage} [ms]" for stage in WHOLE)
    flights = [f"| flight | kernels | {means} | heap calls an image | tracks | images a track lasts | ATE [mm] |"]
    flights.append("|---|---" + "|---:" * (len(WHOLE) + 4) + "|")
    stages = ["| flight | stage | " + " | ".join(f"{name}: median [ms] | worst" for name in PROGRAMS) + " |"]
    stages.append("|---|---|---:|---:|---:|---:|")
    for recording in arguments.recordings:
        of_flight, of_stages = compare(recording, arguments.build / "bin", arguments.rounds, arguments.draws)
        flights += of_flight
        stages += of_stages
    print("\n".join([*flights, "", *stages]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
