"""Whole flights: the same seed gives the same bytes, streams are independent, nothing half-written is left behind."""

from __future__ import annotations

import errno
import hashlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from plumb_tools.demo.process import progress_of
from plumb_tools.sim import __main__ as command
from plumb_tools.sim import asl, kept, simulate
from plumb_tools.trajectory import ASL_TRUTH, read_csv, read_truth
from sim_scenes import changed, plan, write

TOOLS = Path(__file__).resolve().parents[1]


def _flown(folder: Path, name: str, changes: dict[str, object] | None = None, seed: int = 0) -> Path:
    target = folder / name
    of = plan(folder, changes, seed)
    simulate.fly(of, target, kept.origin(of.scene, seed, None, None, with_log=True), report=lambda *_: None)
    return target


def _digests(flight: Path) -> dict[str, str]:
    return {
        str(path.relative_to(flight)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(flight.rglob("*"))
        if path.is_file()
    }


def _values(flight: Path, sensor: str, columns: tuple[str, ...]) -> np.ndarray:
    table = read_csv(flight / "mav0" / sensor / "data.csv", "timestamp", columns)
    return np.column_stack([table.columns[name] for name in columns])


IMU_COLUMNS = ("w_RS_S_x", "w_RS_S_y", "w_RS_S_z", "a_RS_S_x", "a_RS_S_y", "a_RS_S_z")


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    first, second, other = (_flown(tmp_path, name, seed=seed) for name, seed in (("a", 7), ("b", 7), ("c", 8)))
    assert _digests(first) == _digests(second)
    assert len(_digests(first)) > 12 + 8
    images = [sorted((flight / "mav0/cam0/data").iterdir())[3].read_bytes() for flight in (first, other)]
    assert images[0] != images[1]
    assert not np.array_equal(_values(first, "imu0", IMU_COLUMNS), _values(other, "imu0", IMU_COLUMNS))


def test_sensors_do_not_disturb_one_another(tmp_path: Path) -> None:
    plain = _digests(_flown(tmp_path, "plain"))
    noisy = _digests(_flown(tmp_path, "noisy", {"sensors.lrf.noise_m": 0.5, "sensors.lrf.dropout": 0.5}))
    differing = {name for name in plain if plain[name] != noisy.get(name)}
    assert differing == {
        "flight.lcmlog",
        "mav0/range0/data.csv",
        "mav0/range0/sensor.yaml",
        "scene.yaml",
        "simulated.json",
    }


def test_a_flight_is_what_the_readers_expect(tmp_path: Path) -> None:
    flight = _flown(tmp_path, "flight")
    truth = read_truth(flight)
    assert truth.span_source == "images"
    assert len(truth.trajectory) == 301
    ranges = _values(flight, "range0", ("range",))
    assert np.all((ranges == 0.0) | ((ranges > 1.0) & (ranges < 5.0)))
    biases = read_csv(flight / ASL_TRUTH, "timestamp", ("b_w_RS_S_x", "b_a_RS_S_z"))
    assert np.all(biases.columns["b_a_RS_S_z"] != 0.0)
    assert (flight / simulate.LOG_FILE).stat().st_size > 12 * 160 * 120


def test_faults_take_effect(tmp_path: Path) -> None:
    spans = {"camera_outage": 0.1, "range_outage": 0.4, "imu_outage": 0.7, "camera_dark": 0.9}
    faults = [{"kind": kind, "start_s": start, "duration_s": 0.2} for kind, start in spans.items()]
    whole, hurt = _flown(tmp_path, "whole"), _flown(tmp_path, "hurt", {"faults": faults})
    assert len(_values(whole, "imu0", IMU_COLUMNS)) - len(_values(hurt, "imu0", IMU_COLUMNS)) == 50
    assert np.sum(_values(hurt, "range0", ("range",)) == 0.0) >= 5
    images = [sorted(path.name for path in (flight / "mav0/cam0/data").iterdir()) for flight in (whole, hurt)]
    assert len(images[0]) - len(images[1]) == 2
    assert set(images[1]) < set(images[0])


def test_water_gives_no_return(tmp_path: Path) -> None:
    pond = [{"kind": "water", "center_m": [0.5, 0], "size_m": [8, 8]}]
    assert np.all(_values(_flown(tmp_path, "pond", {"scene.objects": pond}), "range0", ("range",)) == 0.0)


@pytest.mark.parametrize(
    "signals",
    [[signal.SIGINT], [signal.SIGINT, signal.SIGTERM, signal.SIGTERM, signal.SIGINT]],
    ids=["once", "impatiently"],
)
def test_an_interrupt_leaves_nothing(signals: list[signal.Signals], tmp_path: Path) -> None:
    scene = write(tmp_path, changed({"sensors.camera.rate_hz": 200}))
    target = tmp_path / "flight"
    environment = os.environ | {"PYTHONPATH": str(TOOLS)}
    process = subprocess.Popen(
        [sys.executable, "-m", "plumb_tools.sim", str(scene), "--out", str(target)],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
    )
    images = tmp_path / "flight.partial" / "mav0" / "cam0" / "data"
    deadline = time.monotonic() + 120.0
    while not (images.is_dir() and any(images.iterdir())):
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline
        time.sleep(0.01)
    for number in signals:
        process.send_signal(number)
        time.sleep(0.002)
    _, message = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "interrupted" in message
    assert "Traceback" not in message
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scene.yaml"]


def test_without_a_terminal_progress_is_told_in_lines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = write(tmp_path, changed({}))
    assert command.main([str(scene), "--out", str(tmp_path / "flight"), "--no-log"]) == 0
    told = capsys.readouterr().err.splitlines()
    assert "simulate: building the world" in told
    taken = [line for line in told if line.startswith("simulate: taking images, ")]
    done = [progress_of(line) for line in taken if not line.endswith("since the start")]
    assert len(done) == 3 and done[0] == 0.0 and done[2] == 1.0


def test_a_full_disk_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "data.csv")

    monkeypatch.setattr(asl, "write", full)
    scene = write(tmp_path, changed({}))
    assert command.main([str(scene), "--out", str(tmp_path / "flight"), "--duration", "0.3"]) == 2
    assert "No space left" in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scene.yaml"]


def test_without_a_gpu_it_draws_in_software_and_says_so_once(tmp_path: Path) -> None:
    scene = write(tmp_path, changed({}))
    done = subprocess.run(
        [sys.executable, "-m", "plumb_tools.sim", str(scene), "--out", str(tmp_path / "flight"), "--duration", "0.3"],
        env={"PYTHONPATH": str(TOOLS), "LIBGL_ALWAYS_SOFTWARE": "1"},
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    told = [line for line in done.stderr.splitlines() if "GPU" in line]
    assert len(told) == 1 and told[0].startswith("simulate: no GPU, drawing in software (")
    assert any((tmp_path / "flight/mav0/cam0/data").iterdir())
