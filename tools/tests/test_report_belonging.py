"""A replay is shown only with the flight that was flown, even where another one has the same stamps."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

import made_flight
from plumb_tools.report.__main__ import main
from plumb_tools.report.belonging import expect_same_flight
from plumb_tools.report.flight import read_flight
from plumb_tools.report.run import read_run
from plumb_tools.score.__main__ import main as score
from plumb_tools.trajectory import InputError

RANGES, IMU = "mav0/range0/data.csv", "mav0/imu0/data.csv"


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    return made_flight.write_flight(tmp_path / "flight")


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return made_flight.write_run(tmp_path / "range")


def _check(flight: Path, run: Path) -> None:
    expect_same_flight(read_flight(flight), read_run(run, "range-VIO"))


def _refused(flight: Path, run: Path) -> str:
    with pytest.raises(InputError) as caught:
        _check(flight, run)
    message = str(caught.value)
    assert message.startswith(f"{run}: is not a replay of {flight}: ")
    assert message.endswith("; expected the recording that was flown")
    return message


def _summary(run: Path, **changes: Any) -> None:
    path = run / "summary.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def test_the_flight_that_was_flown_is_accepted_under_any_name(flight: Path, run: Path, tmp_path: Path) -> None:
    _check(flight, run)
    _summary(run, source=str(flight))
    shutil.copytree(flight, tmp_path / "copy")
    _check(flight, run)
    _check(tmp_path / "copy", run)


def test_images_that_are_not_in_the_flight_are_told(flight: Path, run: Path) -> None:
    images = flight / "mav0/cam0/data.csv"
    lines = images.read_text().splitlines()
    images.write_text("\n".join([*lines[:50], *lines[51:]]))
    assert f"its image at {lines[50].split(',')[0]} ns is not in mav0/cam0/data.csv" in _refused(flight, run)


def test_counts_that_differ_are_told(flight: Path, run: Path) -> None:
    samples = (flight / IMU).read_text()
    (flight / IMU).write_text(samples + "9999999999,0,0,0,0,0,0\n")
    assert "summary.json has 120 imu_samples, mav0/imu0/data.csv has 121" in _refused(flight, run)
    _summary(run, recorded_hashes={"recorded": 120, "different": 0})
    _check(flight, run)


def test_ranges_of_another_flight_are_told(flight: Path, run: Path) -> None:
    (flight / RANGES).write_text((flight / RANGES).read_text().replace("10.000", "10.020"))
    told = _refused(flight, run)
    assert "114 of its 115 ranges are not in mav0/range0/data.csv, first 10.000 m at 1250000000 ns" in told
    shutil.rmtree(flight / "mav0/range0")
    assert "flown with ranges, mav0/range0/data.csv is missing" in _refused(flight, run)


def test_the_report_of_another_flight_is_not_made(
    flight: Path, run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (flight / RANGES).write_text((flight / RANGES).read_text().replace("10.000", "10.020"))
    assert main([str(run), "--flight", str(flight), "--out", str(tmp_path / "out.html")]) == 2
    assert "is not a replay of" in capsys.readouterr().err and not (tmp_path / "out.html").exists()


def test_a_replay_is_not_scored_against_another_flight(
    flight: Path, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert score([str(flight), str(run)]) == 0
    (flight / RANGES).write_text((flight / RANGES).read_text().replace("10.000", "10.020"))
    for estimate in (run, run / "trajectory.tum"):
        assert score([str(flight), str(estimate)]) == 2
        assert "is not a replay of" in capsys.readouterr().err


def test_without_ranges_the_recording_that_the_replay_names_is_compared(flight: Path, tmp_path: Path) -> None:
    run = made_flight.write_run(tmp_path / "vio", with_range=False)
    other = shutil.copytree(flight, tmp_path / "other")
    _summary(run, source=str(other))
    _check(flight, run)
    (other / IMU).write_text((other / IMU).read_text().replace("9.8", "9.7"))
    assert f"it was flown from {other}, and {IMU} there is another" in _refused(flight, run)
