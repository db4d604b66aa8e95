"""The exact profile's programs for this machine and for 64-bit ARM, which run in an emulator here."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
HOST = ROOT / "build/exact/bin"
ARM64 = ROOT / "build/arm64-exact/bin"
EMULATOR = ("qemu-aarch64", "-L", str(ROOT / "build/sysroot-arm64"))
_BIT_FILES = ("states.csv", "covariance.csv", "features.csv", "trajectory_imu.tum")


def skip_unless_built(*programs: str) -> None:
    """They take minutes to build, so that only tools/test --arm64 does."""
    files = [ARM64 / program for program in programs] + [HOST / "plumb-replay"]
    if shutil.which(EMULATOR[0]) is None or not all(file.is_file() for file in files):
        pytest.skip("the presets exact and arm64-exact are not built: tools/test --arm64")


def expect_same_results(one: Path, other: Path) -> None:
    """Every image's state ends in a hash over all that the filter carries on, so equal files are equal bits."""
    for file in _BIT_FILES:
        a, b = ((folder / file).read_text().splitlines() for folder in (one, other))
        assert len(a) == len(b) > 1
        first = next((row for row, pair in enumerate(zip(a, b, strict=True)) if pair[0] != pair[1]), None)
        assert first is None, f"{file} differs from line {first + 1} on:\n{a[first]}\n{b[first]}"
