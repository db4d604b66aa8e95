"""Whether a replay is one of the flight that it is shown with: equal stamps alone do not tell."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from plumb_tools.report.flight import RANGE_DATA, Flight
from plumb_tools.report.run import RangeOutcome, Run
from plumb_tools.score.estimate import SUMMARY_FILE
from plumb_tools.trajectory import ASL_IMAGES, InputError, data_lines, read_text

IMU_DATA = Path("mav0/imu0/data.csv")
#: Tables in which two recordings of one sensor suite differ.
_TABLES = (ASL_IMAGES, IMU_DATA, RANGE_DATA)

#: A range that was fused is among so many samples up to its image, to this much.
_SAMPLES_BEFORE = 5
_SAME_RANGE_M = 1e-3


def expect_same_flight(flight: Flight, run: Run) -> None:
    """Refuses a replay of another flight, and says what does not match."""
    for difference in (_images, _counts, _ranges, _tables):
        if (found := difference(flight, run)) is not None:
            raise InputError(
                f"{run.folder}: is not a replay of {flight.folder}: {found}; expected the recording that was flown"
            )


def _images(flight: Flight, run: Run) -> str | None:
    unknown = run.states.t_ns[~np.isin(run.states.t_ns, flight.t_images_ns)]
    return f"its image at {unknown[0]} ns is not in {ASL_IMAGES}" if unknown.size else None


def _counts(flight: Flight, run: Run) -> str | None:
    """What plumb-replay read. A log need not hold every sample of the recording that it was made from."""
    if "recorded_hashes" in run.summary or Path(run.summary["source"]).is_file():
        return None
    inputs = run.summary["inputs"]
    counts = [("images", len(flight.t_images_ns), ASL_IMAGES), ("imu_samples", _imu_samples(flight), IMU_DATA)]
    if flight.range_finder is not None and inputs["ranges"] > 0:  # flown without range it counts none
        counts.append(("ranges", len(flight.range_finder.t_ns), RANGE_DATA))
    for key, there, file in counts:
        if inputs[key] != there:
            return f"{SUMMARY_FILE} has {inputs[key]} {key}, {file} has {there}"
    return None


def _imu_samples(flight: Flight) -> int:
    return sum(1 for _ in data_lines(read_text(flight.folder / IMU_DATA)))


def _ranges(flight: Flight, run: Run) -> str | None:
    states, finder = run.states, flight.range_finder
    rows = np.flatnonzero((states["range_outcome"] != RangeOutcome.NONE) & (states["range_measured_m"] > 0.0))
    if not rows.size:
        return None
    if finder is None:
        return f"it was flown with ranges, {RANGE_DATA} is missing"
    newest = np.searchsorted(finder.t_ns, states.t_ns[rows], side="right") - 1
    before = np.maximum(newest[:, None] - np.arange(_SAMPLES_BEFORE), 0)
    off_m = np.abs(finder.range_m[before] - states["range_measured_m"][rows, None]).min(axis=1)
    strange = rows[off_m > _SAME_RANGE_M]
    if not strange.size:
        return None
    measured_m, t_ns = states["range_measured_m"][strange[0]], states.t_ns[strange[0]]
    return f"{strange.size} of its {rows.size} ranges are not in {RANGE_DATA}, first {measured_m:.3f} m at {t_ns} ns"


def _tables(flight: Flight, run: Run) -> str | None:
    """The recording that the replay names, when it is there to be compared and lies in another folder."""
    source = Path(run.summary["source"])
    if not source.is_dir() or source.samefile(flight.folder):
        return None
    for table in _TABLES:
        flown, shown = source / table, flight.folder / table
        if flown.is_file() and shown.is_file() and flown.read_bytes() != shown.read_bytes():
            return f"it was flown from {source}, and {table} there is another"
    return None
