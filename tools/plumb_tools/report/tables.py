"""Reader of the csv files of plumb-replay, in which numbers may be `nan` and other columns may hold anything."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plumb_tools.trajectory import FloatArray, InputError, IntArray

STAMP = "t_ns"


@dataclass(frozen=True)
class Table:
    """Columns of a csv file under their names; the stamp is kept in whole nanoseconds."""

    path: Path
    t_ns: IntArray
    columns: dict[str, FloatArray]

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.t_ns)

    def __getitem__(self, name: str) -> FloatArray:
        """Column (N,)."""
        return self.columns[name]

    def __contains__(self, name: str) -> bool:
        """True when the file has this column and it was asked for."""
        return name in self.columns

    def stack(self, names: Sequence[str]) -> FloatArray:
        """Named columns side by side, (N, len(names))."""
        return np.column_stack([self.columns[name] for name in names])


def header_of(path: Path) -> list[str]:
    """Column names of the first line."""
    if not path.is_file():
        raise InputError(f"{path}: no such file; expected one that plumb-replay wrote")
    with path.open(encoding="utf-8", errors="replace") as stream:
        return stream.readline().strip().lstrip("#").split(",")


def read_table(path: Path, required: Sequence[str], optional: Sequence[str] = ()) -> Table:
    """Reads the stamp and the named columns; optional ones only where the file has them."""
    header = header_of(path)
    missing = [name for name in (STAMP, *required) if name not in header]
    if missing:
        raise InputError(f"{path}: missing column(s) {', '.join(missing)}; it has {', '.join(header)}")
    wanted = [*required, *(name for name in optional if name in header)]
    places = [header.index(name) for name in wanted]
    try:
        stamps = np.loadtxt(path, np.int64, delimiter=",", skiprows=1, usecols=header.index(STAMP), ndmin=1)
        values = np.loadtxt(path, np.float64, delimiter=",", skiprows=1, usecols=places, ndmin=2)
    except (ValueError, IndexError) as error:
        raise InputError(f"{path}: {error}") from None
    if not len(stamps):
        raise InputError(f"{path}: holds no data line")
    return Table(path, stamps, {name: values[:, i] for i, name in enumerate(wanted)})
