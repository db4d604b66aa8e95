"""Reader of an estimate: a TUM file, or the output folder of plumb-replay (`trajectory.tum`, `states.csv` and
`covariance.csv`).

The covariance is that of nav_state.h: p, v, attitude, gyro bias, accelerometer bias, three each; position and
velocity errors additive in W, attitude error local (R = R_hat Exp(dtheta)). Only what scoring needs is read.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from plumb_tools.trajectory import (
    CsvTable,
    FloatArray,
    InputError,
    IntArray,
    Trajectory,
    read_csv,
    read_text,
    read_tum,
    stack,
    stamp_text,
)

TRAJECTORY_FILE = "trajectory.tum"
STATES_FILE = "states.csv"
COVARIANCE_FILE = "covariance.csv"
SUMMARY_FILE = "summary.json"

#: What a replay came to whose filter gave no state, and why that is when it was flown without range.
NEVER_STARTED = "never started"
WITHOUT_RANGE = (
    "without range, only a standstill or enough acceleration tells the scale, "
    "and the filter gives no state rather than a wrong one"
)

#: trajectory.tum may be written with microseconds only: a stamp of the csv files this near is the same instant.
SAME_INSTANT_NS = 1_000

STAMP_COLUMN = "t_ns"
VALID_COLUMN = "valid"
RESET_COLUMN = "reset_count"
VELOCITY_COLUMNS = ("v_WI_x_m_s", "v_WI_y_m_s", "v_WI_z_m_s")

#: Names of the errors in covariance.csv, as far as they are read.
POSITION_ERRORS = ("px", "py", "pz")
VELOCITY_ERRORS = ("vx", "vy", "vz")
ATTITUDE_ERRORS = ("ax", "ay", "az")


def block_columns(errors: tuple[str, ...]) -> tuple[str, ...]:
    """Columns of covariance.csv, which has the upper triangle, for a diagonal block in full, row by row."""
    size = range(len(errors))
    return tuple(f"P_{errors[min(i, j)]}_{errors[max(i, j)]}" for i in size for j in size)


@dataclass(frozen=True)
class Covariances:
    """3x3 covariance blocks of each pose, (N, 3, 3)."""

    position: FloatArray  #: in W [m^2]
    velocity: FloatArray  #: in W [m^2/s^2]
    attitude: FloatArray  #: local, in I [rad^2]

    def select(self, index: npt.NDArray[np.bool_] | IntArray) -> Covariances:
        """The blocks at the given places."""
        return Covariances(self.position[index], self.velocity[index], self.attitude[index])


@dataclass(frozen=True)
class Estimate:
    """An estimated trajectory and, when it comes from plumb-replay, what the filter knew about its errors."""

    trajectory: Trajectory
    covariances: Covariances | None
    reset_count: IntArray  #: (N,) re-initialisations so far; position and yaw start anew at each
    notes: tuple[str, ...] = ()  #: what the reader should know about how it was read


def read_estimate(path: Path) -> Estimate:
    """Estimate from a TUM file or from an output folder of plumb-replay, given itself or by its trajectory.tum."""
    if not path.exists():
        raise InputError(f"{path}: no such file or folder")
    if path.is_dir():
        return _read_replay_folder(path)
    first = read_text(path).split("\n", 1)[0]
    if "," in first:
        raise InputError(f"{path}:1: looks like csv; the estimate must be a TUM file or a folder of plumb-replay")
    alone = _read_alone(path)
    return alone if path.name != TRAJECTORY_FILE else _with_what_lies_beside(path, alone)


def _read_alone(path: Path) -> Estimate:
    trajectory = read_tum(path)
    return Estimate(trajectory, None, np.zeros(len(trajectory), dtype=np.int64))


def _with_what_lies_beside(path: Path, alone: Estimate) -> Estimate:
    """The trajectory of a replay with the states and covariances of the same replay, where they are."""
    files = (SUMMARY_FILE, STATES_FILE, COVARIANCE_FILE)
    if not all((path.parent / name).is_file() for name in files):
        return alone
    beside = f"{STATES_FILE} and {COVARIANCE_FILE} beside {path}"
    try:
        whole = _read_replay_folder(path.parent)
    except InputError as error:
        return replace(alone, notes=(f"{beside} are left out, they do not belong to it: {error}",))
    return replace(whole, notes=(f"{beside} are of the same replay and read with it, as the whole folder would be",))


def never_started(folder: Path) -> str | None:
    """Says so when a replay gave no state at all; None when it gave one, or when its summary cannot be read."""
    try:
        summary = json.loads((folder / SUMMARY_FILE).read_text(encoding="utf-8"))
        if summary["images_valid"] > 0:
            return None
        reason = f"{NEVER_STARTED}: none of {summary['images_processed']} images has a state"
        return reason if summary["inputs"]["ranges"] > 0 else f"{reason}; {WITHOUT_RANGE}"
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _read_replay_folder(folder: Path) -> Estimate:
    if (reason := never_started(folder)) is not None:
        raise InputError(f"{folder}: {reason}; expected a replay with a state")
    for name in (TRAJECTORY_FILE, STATES_FILE, COVARIANCE_FILE):
        if not (folder / name).exists():
            raise InputError(
                f"{folder}: not an output folder of plumb-replay: {name} is missing (a TUM file can be scored alone)"
            )
    trajectory = read_tum(folder / TRAJECTORY_FILE)
    states = read_csv(folder / STATES_FILE, STAMP_COLUMN, (*VELOCITY_COLUMNS, RESET_COLUMN), only_where=VALID_COLUMN)
    rows = _rows_at(trajectory, states)
    return Estimate(
        replace(trajectory, name=str(folder), v_m_s=stack(states, VELOCITY_COLUMNS)[rows]),
        _read_covariances(folder / COVARIANCE_FILE, trajectory),
        states.columns[RESET_COLUMN][rows].astype(np.int64),
    )


def _read_covariances(path: Path, trajectory: Trajectory) -> Covariances:
    blocks = [block_columns(errors) for errors in (POSITION_ERRORS, VELOCITY_ERRORS, ATTITUDE_ERRORS)]
    table = read_csv(path, STAMP_COLUMN, tuple(dict.fromkeys(name for block in blocks for name in block)))
    rows = _rows_at(trajectory, table)
    return Covariances(*(stack(table, block)[rows].reshape(-1, 3, 3) for block in blocks))


def _rows_at(trajectory: Trajectory, table: CsvTable) -> IntArray:
    """Row of a csv file at each pose of the trajectory."""
    after = np.clip(np.searchsorted(table.t_ns, trajectory.t_ns), 0, len(table.t_ns) - 1)
    before = np.maximum(after - 1, 0)
    nearer_before = np.abs(table.t_ns[before] - trajectory.t_ns) < np.abs(table.t_ns[after] - trajectory.t_ns)
    rows = np.where(nearer_before, before, after)
    missing = np.flatnonzero(np.abs(table.t_ns[rows] - trajectory.t_ns) > SAME_INSTANT_NS)
    if missing.size:
        first = stamp_text(trajectory.t_ns[missing[0]])
        raise InputError(
            f"{table.path}: no row for {missing.size} stamps of {TRAJECTORY_FILE}, the first of them {first} s"
        )
    return np.asarray(rows, dtype=np.int64)
