"""Readers of trajectories: TUM text and the ASL (EuRoC) folder.

Stamps are kept as integer nanoseconds, because a double holds a present-day epoch in seconds to 0.2 us only.
Every fault of a file is reported as an `InputError` that names the file and, where there is one, the line.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

ASL_TRUTH = Path("mav0/state_groundtruth_estimate0/data.csv")
ASL_IMAGES = Path("mav0/cam0/data.csv")

NS_PER_S = 1_000_000_000

#: A quaternion further from unit length than this is a fault of the file, not rounding (EuRoC writes 6 decimals).
QUATERNION_NORM_TOLERANCE = 1e-3

_TUM_COLUMNS = "t tx ty tz qx qy qz qw"
_ASL_POSITION = ("p_RS_R_x", "p_RS_R_y", "p_RS_R_z")
_ASL_QUATERNION_XYZW = ("q_RS_x", "q_RS_y", "q_RS_z", "q_RS_w")
_ASL_VELOCITY = ("v_RS_R_x", "v_RS_R_y", "v_RS_R_z")


class InputError(Exception):
    """A fault of what the user gave; the message is complete as it stands."""


@dataclass(frozen=True)
class Trajectory:
    """Poses of the IMU I in a z-up world W at strictly increasing stamps."""

    name: str
    t_ns: IntArray  #: (N,) stamps
    p_m: FloatArray  #: (N, 3) origin of I in W
    rotation: Rotation  #: N rotations from I to W
    v_m_s: FloatArray | None = None  #: (N, 3) velocity of I in W, where the file gives it

    def __len__(self) -> int:
        """Number of poses."""
        return len(self.t_ns)


@dataclass(frozen=True)
class Truth:
    """A true trajectory and the span an estimator is expected to cover."""

    trajectory: Trajectory
    span_ns: tuple[int, int]  #: first and last image where known, else first and last truth
    span_source: str  #: "images" or "truth"


@dataclass(frozen=True)
class CsvTable:
    """Columns of numbers of a csv file, by name, with the line each row came from."""

    path: Path
    columns: dict[str, FloatArray]
    t_ns: IntArray
    lines: list[int]


def stamp_text(t_ns: int) -> str:
    """A stamp in seconds with all nine decimals."""
    return f"{Decimal(int(t_ns)).scaleb(-9):.9f}"


def read_text(path: Path) -> str:
    """Contents of a text file."""
    if path.is_dir():
        raise InputError(f"{path}: is a folder, a file is expected")
    if not path.exists():
        raise InputError(f"{path}: no such file")
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as text: {error}") from error


def data_lines(text: str) -> Iterator[tuple[int, str]]:
    """The lines of a table that are neither empty nor comments, with their numbers."""
    for number, line in enumerate(text.splitlines(), start=1):
        stripped = line.strip()
        if stripped and not stripped.startswith("#"):
            yield number, stripped


def _floats(fields: list[str], where: str) -> list[float]:
    values = []
    for field in fields:
        try:
            value = float(field)
        except ValueError:
            raise InputError(f"{where}: '{field.strip()}' is not a number") from None
        if not math.isfinite(value):
            raise InputError(f"{where}: '{field.strip()}' is not finite")
        values.append(value)
    return values


def _seconds_to_ns(field: str, where: str) -> int:
    try:
        return int((Decimal(field) * NS_PER_S).to_integral_value())
    except (InvalidOperation, ValueError, OverflowError):
        raise InputError(f"{where}: '{field}' is not a stamp in seconds") from None


def _integer_ns(field: str, where: str) -> int:
    try:
        return int(field)
    except ValueError:
        raise InputError(f"{where}: '{field.strip()}' is not a stamp in whole nanoseconds") from None


def _stamps(path: Path, stamps: list[int], lines: list[int]) -> IntArray:
    """Stamps as an array, checked to increase and to fit."""
    if not stamps:
        raise InputError(f"{path}: holds no data line")
    limit = np.iinfo(np.int64).max
    for line, stamp in zip(lines, stamps, strict=True):
        if abs(stamp) > limit:
            raise InputError(f"{path}:{line}: stamp out of range; are seconds and nanoseconds mixed up?")
    array = np.array(stamps, dtype=np.int64)
    bad = np.flatnonzero(np.diff(array) <= 0)
    if bad.size:
        later, earlier = int(bad[0]) + 1, int(bad[0])
        raise InputError(
            f"{path}:{lines[later]}: stamp {stamp_text(array[later])} s does not come after "
            f"{stamp_text(array[earlier])} s of line {lines[earlier]}; stamps must increase"
        )
    return array


def rotations(path: Path, quaternions_xyzw: FloatArray, lines: list[int]) -> Rotation:
    """Rotations of Hamilton quaternions (N, 4) in the order x y z w, checked to be unit."""
    norms = np.linalg.norm(quaternions_xyzw, axis=1)
    bad = np.flatnonzero(np.abs(norms - 1.0) > QUATERNION_NORM_TOLERANCE)
    if bad.size:
        row = int(bad[0])
        raise InputError(f"{path}:{lines[row]}: quaternion has length {norms[row]:.6f}, not 1")
    return Rotation.from_quat(quaternions_xyzw)


def read_tum(path: Path) -> Trajectory:
    """Trajectory of a TUM file: `t tx ty tz qx qy qz qw`, seconds and metres, separated by blanks."""
    stamps: list[int] = []
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, line in data_lines(read_text(path)):
        where = f"{path}:{number}"
        fields = line.split()
        if len(fields) != 8:
            raise InputError(f"{where}: {len(fields)} fields, TUM has 8: {_TUM_COLUMNS}")
        rows.append(_floats(fields[1:], where))
        stamps.append(_seconds_to_ns(fields[0], where))
        lines.append(number)
    t_ns = _stamps(path, stamps, lines)
    values = np.array(rows, dtype=np.float64)
    return Trajectory(str(path), t_ns, values[:, :3], rotations(path, values[:, 3:], lines))


def _csv_header(path: Path, text: str) -> list[str]:
    """Column names of the first line: a leading '#' and units in brackets are taken off."""
    first = text.lstrip("\ufeff").split("\n", 1)[0].strip()
    names = [name.split("[")[0].strip() for name in first.lstrip("#").split(",")]
    if not any(name and not name[0].isdigit() and name[0] not in "+-." for name in names):
        raise InputError(f"{path}:1: the first line must name the columns")
    return names


def read_csv(
    path: Path,
    stamp_column: str,
    required: tuple[str, ...],
    optional: tuple[str, ...] = (),
    only_where: str | None = None,
) -> CsvTable:
    """Numeric columns of a csv file by their names in the first line; other columns may hold anything.

    The stamp is in whole nanoseconds. Rows are left out where the column `only_where` is 0.
    """
    text = read_text(path)
    header = _csv_header(path, text)
    needed = (stamp_column, *required, *(() if only_where is None else (only_where,)))
    missing = [name for name in needed if name not in header]
    if missing:
        raise InputError(f"{path}: missing column(s) {', '.join(missing)}; it has {', '.join(header)}")
    wanted = [name for name in (*required, *optional) if name in header]
    positions = [header.index(name) for name in wanted]
    stamp_position = header.index(stamp_column)
    filter_position = None if only_where is None else header.index(only_where)

    stamps: list[int] = []
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, line in data_lines(text):
        if number == 1:
            continue
        where = f"{path}:{number}"
        fields = line.split(",")
        if len(fields) != len(header):
            raise InputError(f"{where}: {len(fields)} fields, the header names {len(header)}")
        if filter_position is not None and fields[filter_position].strip() == "0":
            continue
        stamps.append(_integer_ns(fields[stamp_position], where))
        rows.append(_floats([fields[position] for position in positions], where))
        lines.append(number)
    t_ns = _stamps(path, stamps, lines)
    values = np.array(rows, dtype=np.float64).reshape(len(rows), len(wanted))
    return CsvTable(path, {name: values[:, i] for i, name in enumerate(wanted)}, t_ns, lines)


def stack(table: CsvTable, names: tuple[str, ...]) -> FloatArray:
    """Named columns of a table side by side, (N, len(names))."""
    return np.column_stack([table.columns[name] for name in names])


def read_asl_truth(path: Path) -> Trajectory:
    """Trajectory of an ASL `state_groundtruth_estimate0/data.csv`; velocity where the file has it."""
    table = read_csv(path, "timestamp", _ASL_POSITION + _ASL_QUATERNION_XYZW, _ASL_VELOCITY)
    has_velocity = all(name in table.columns for name in _ASL_VELOCITY)
    return Trajectory(
        str(path),
        table.t_ns,
        stack(table, _ASL_POSITION),
        rotations(path, stack(table, _ASL_QUATERNION_XYZW), table.lines),
        stack(table, _ASL_VELOCITY) if has_velocity else None,
    )


def read_truth(path: Path) -> Truth:
    """Truth from an ASL folder, from its truth csv, or from a TUM file."""
    if not path.exists():
        raise InputError(f"{path}: no such file or folder")
    if path.is_dir():
        if not (path / ASL_TRUTH).exists():
            raise InputError(f"{path}: not an ASL folder with truth: {ASL_TRUTH} is missing")
        trajectory = read_asl_truth(path / ASL_TRUTH)
        if (path / ASL_IMAGES).exists():
            images = read_csv(path / ASL_IMAGES, "timestamp", ())
            return Truth(trajectory, (int(images.t_ns[0]), int(images.t_ns[-1])), "images")
    else:
        first = read_text(path).lstrip("\ufeff").split("\n", 1)[0]
        is_tum = path.suffix.lower() != ".csv" and "," not in first
        trajectory = read_tum(path) if is_tum else read_asl_truth(path)
    return Truth(trajectory, (int(trajectory.t_ns[0]), int(trajectory.t_ns[-1])), "truth")
