"""The exact profile's programs for this machine and for 64-bit ARM, which run in an emulator here."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
HOST = ROOT / "build/exact/bin"
ARM64 = ROOT / "build/arm64-exact/bin"
EMULATOR = ("qemu-aarch64", "-L", str(ROOT / "build/sysroot-arm64"))
_BIT_FILES = ("states.csv", "covariance.csv", "features.csv", "trajectory_imu.tum")


def skip_unless_built(*programs: str) -> None:
    """They take minutes to build, so that tools/test --quick does not, and sets PLUMB_TARGET to false.

    Where it is true, tools/test has built them, and nothing may be missing.
    """
    if os.environ.get("PLUMB_TARGET") == "false":
        pytest.skip("left out: tools/test without --quick, or with --arm64")
    missing = [] if shutil.which(EMULATOR[0]) else [f"{EMULATOR[0]} of the package qemu-user"]
    missing += [str(ARM64 / program) for program in programs if not (ARM64 / program).is_file()]
    if missing:
        _miss("PLUMB_TARGET", f"not there: {', '.join(missing)}; tools/test without --quick, or with --arm64, makes it")


def whole() -> bool:
    """Whether all is asked for, and the exact profile of this machine built."""
    return os.environ.get("PLUMB_ARM64") != "false" and (HOST / "plumb-replay").is_file()


def skip_unless_whole() -> None:
    if not whole():
        _miss("PLUMB_ARM64", f"not asked for, or not there: {HOST / 'plumb-replay'}; tools/test --arm64 makes it")


def _miss(asked: str, what: str) -> None:
    if os.environ.get(asked) == "true":
        pytest.fail(what)
    pytest.skip(what)


def expect_same_results(one: Path, other: Path) -> None:
    """Every image's state ends in a hash over all that the filter carries on, so equal files are equal bits."""
    for file in _BIT_FILES:
        a, b = ((folder / file).read_text().splitlines() for folder in (one, other))
        assert len(a) == len(b) > 1
        first = next((row for row, pair in enumerate(zip(a, b, strict=True)) if pair[0] != pair[1]), None)
        assert first is None, f"{file} differs from line {first + 1} on:\n{a[first]}\n{b[first]}"
