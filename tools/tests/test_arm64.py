"""The exact profile gives the same bits on x86 and on 64-bit ARM, which runs in an emulator here."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

import sim_scenes
from arm64_programs import ARM64, EMULATOR, HOST, expect_same_results, skip_unless_built, skip_unless_whole

REAL_IMAGES = 120
FUSED_IMAGES = 40
FLIGHTS = "PLUMB_EXACT_FLIGHTS"  # recordings in ASL layout, with a colon between them


@pytest.fixture(autouse=True)
def _built() -> None:
    skip_unless_whole()
    skip_unless_built("plumb-replay", "plumb-exact-kernels", "plumb-contracted-kernels", "plumb-contracted-replay")


def _first_images(recording: Path, to: Path, images: int) -> Path:
    """The recording cut to its first images, without a copy of them."""
    camera = to / "mav0/cam0"
    camera.mkdir(parents=True)
    for sensor in ("imu0", "range0"):
        (to / "mav0" / sensor).symlink_to(recording.resolve() / "mav0" / sensor)
    for name in ("sensor.yaml", "data"):
        (camera / name).symlink_to(recording.resolve() / "mav0/cam0" / name)
    rows = (recording / "mav0/cam0/data.csv").read_text().splitlines(keepends=True)
    (camera / "data.csv").write_text("".join(rows[: images + 1]))
    return to


def _expect_same_bits(recording: Path, work: Path) -> None:
    for name, program in (("host", [str(HOST / "plumb-replay")]), ("arm64", [*EMULATOR, str(ARM64 / "plumb-replay")])):
        subprocess.run([*program, "--asl", str(recording), "--out", str(work / name)], check=True, capture_output=True)
    expect_same_results(work / "host", work / "arm64")


def test_a_real_flight_gives_the_same_bits(euroc_mh01: Path, tmp_path: Path) -> None:
    _expect_same_bits(_first_images(euroc_mh01, tmp_path / "cut", REAL_IMAGES), tmp_path)


def test_a_real_flight_gives_other_bits_when_the_compiler_may_fuse_multiplications(
    euroc_mh01: Path, tmp_path: Path
) -> None:
    recording = _first_images(euroc_mh01, tmp_path / "cut", FUSED_IMAGES)
    states = []
    for name in ("plumb-replay", "plumb-contracted-replay"):
        program = [*EMULATOR, str(ARM64 / name)]
        subprocess.run([*program, "--asl", str(recording), "--out", str(tmp_path / name)], check=True, capture_output=True)
        states.append((tmp_path / name / "states.csv").read_text().splitlines()[1:])
    assert len(states[0]) == len(states[1]) > 0
    assert not set(states[0]) & set(states[1])


def test_a_simulated_flight_gives_the_same_bits(tmp_path: Path) -> None:
    """Rendered here: a climb over a yard, with ranges."""
    _expect_same_bits(sim_scenes.fly_yard(tmp_path, 4.0), tmp_path)


def test_whole_flights_give_the_same_bits(tmp_path: Path) -> None:
    """Minutes each, so only those that are asked for."""
    recordings = [Path(path) for path in os.environ.get(FLIGHTS, "").split(":") if path]
    if not recordings:
        pytest.skip(f"{FLIGHTS} names no recordings to be flown whole")
    for number, recording in enumerate(recordings):
        work = tmp_path / str(number)
        _expect_same_bits(recording, work)
        images = len((work / "host/states.csv").read_text().splitlines()) - 1
        print(f"{recording.name}: {images} images, equal")


def _kernel_hashes(*command: str) -> dict[str, str]:
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return dict(line.rsplit(" ", 1) for line in told.splitlines())


def test_kernels_give_the_same_bits_unless_the_compiler_may_fuse_multiplications() -> None:
    expected = _kernel_hashes(str(HOST / "plumb-exact-kernels"))
    assert len(expected) == 3
    assert _kernel_hashes(*EMULATOR, str(ARM64 / "plumb-exact-kernels")) == expected
    contracted = _kernel_hashes(*EMULATOR, str(ARM64 / "plumb-contracted-kernels"))
    assert contracted.keys() == expected.keys()
    assert all(contracted[name] != expected[name] for name in expected)
