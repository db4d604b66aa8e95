"""The parameters of the flight software, as plumb-replay lists them."""

from __future__ import annotations

import difflib
import re
import subprocess
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from plumb_tools.trajectory import InputError

PROGRAM = Path(__file__).resolve().parents[2] / "build/flight/bin/plumb-replay"
NEVER = "never"

_LINE = re.compile(r"(\S+) +(\S+) +\[(\S+), (\S+)\] (.+?)(, whole)?, (at once|at the next start|never): (.+)")


@dataclass(frozen=True)
class Parameter:
    """One row; numbers as they are printed."""

    name: str
    default: str
    low: str
    high: str
    unit: str
    whole: str | None  #: of one whose values are whole numbers, those that are 0 and 1 for no and yes included
    change: str  #: when a change in flight counts
    what: str

    @property
    def range(self) -> str:
        """The kind of number, the smallest and the largest value, and their unit."""
        return f"a {'whole ' if self.whole else ''}number from {self.low} to {self.high}" + ("" if self.unit == "1" else f" {self.unit}")


def read(program: Path = PROGRAM) -> list[Parameter]:
    """All of them in their order; InputError when the program does not run or says something else."""
    try:
        lines = subprocess.run([program, "--list-params"], check=True, capture_output=True, text=True).stdout.splitlines()
    except (OSError, subprocess.CalledProcessError) as error:
        build = "cmake --preset flight && cmake --build --preset flight --target plumb-replay"
        raise InputError(f"{program}: does not run: {error}; expected it built: {build}") from None
    rows = [Parameter(*match.groups()) for line in lines if (match := _LINE.fullmatch(line))]
    if len(rows) != len(lines) or not rows:
        raise InputError(f"{program} --list-params: a line is no parameter; is it of this version?")
    return rows


def checksum(names: Iterable[str]) -> int:
    """ParamTable::crc() of fsw/params/param_table.h."""
    return zlib.crc32(b"".join(name.encode() + b"\0" for name in names))


def unknown(name: str, names: Iterable[str]) -> str:
    """What to say of a name that is none of them."""
    near = difflib.get_close_matches(name, list(names), n=3, cutoff=0.5)
    return f"no parameter '{name}'" + (f"; did you mean {' or '.join(near)}?" if near else "; tools/command list has all")
