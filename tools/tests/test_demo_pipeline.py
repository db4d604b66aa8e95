"""The way from a scene to figures, with stand-ins for simulator and replay."""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

import made_flight
from plumb_tools import heartbeat
from plumb_tools.demo import __main__ as demo
from plumb_tools.demo import pipeline
from plumb_tools.demo.pipeline import Folders, find_scene
from plumb_tools.demo.process import StepFailed, Steps, progress_of
from plumb_tools.demo.results import COLUMNS, Outcome, cell, error_ratio, footnotes, mean_and_worst, terminal_table
from plumb_tools.sim import kept, scene_file
from plumb_tools.trajectory import InputError

SCENE = """\
scene:
  summary: >
    A straight flight
    over a plain.
trajectory:
  segments: [{do: hold, duration_s: 9}]
"""


@pytest.fixture
def tools(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Scenes, and a simulator and a replay that copy what was made beforehand and note that they were called."""
    made_flight.write_flight(tmp_path / "made/flight")
    made_flight.write_run(tmp_path / "made/range")
    made_flight.write_run(tmp_path / "made/vio", scale=1.1, with_range=False)
    scenes = tmp_path / "scenes"
    scenes.mkdir()
    for name in ("demo", "outdoor"):
        (scenes / f"{name}.yaml").write_text(SCENE)
    made = tmp_path / "made"
    simulate = f'echo simulate >>"{tmp_path}/calls"; mkdir -p "${{4%/*}}"; cp -r "{made}/flight" "$4"; echo "[5/10]"'
    _program(tmp_path / "simulate", simulate)
    _program(
        tmp_path / "plumb-replay",
        f'run=range; [[ "$*" != *--no-range* ]] || run=vio; echo $run >>"{tmp_path}/calls"; cp -r "{made}/$run" "$4"',
    )
    monkeypatch.setattr(scene_file, "SCENES", scenes)
    monkeypatch.setattr(scene_file, "FLIGHTS", tmp_path / "flights")
    monkeypatch.setattr(pipeline, "SIMULATE", tmp_path / "simulate")
    monkeypatch.setattr(pipeline, "REPLAY", tmp_path / "plumb-replay")
    return tmp_path


def _program(path: Path, script: str) -> None:
    path.write_text(f"#!/usr/bin/env bash\nset -eu\n{script}\n")
    path.chmod(0o755)


def _calls(tools: Path) -> list[str]:
    path = tools / "calls"
    return sorted(path.read_text().split()) if path.exists() else []


def _steps() -> Steps:
    return Steps(Console(quiet=True))


@pytest.mark.parametrize(
    ("line", "done"),
    [
        ("[12/48] Building CXX object", 0.25),
        (" 30 %  image 60 of 120, 12 per second", 0.5),
        ("30 % rendered", 0.3),
        ("12.5% of it", 0.12),
        ("reading scene", None),
        ("frame 7 of 0", None),
    ],
)
def test_progress_is_read_from_what_tools_print(line: str, done: float | None) -> None:
    assert progress_of(line) == (None if done is None else pytest.approx(done))


def test_scene_is_found_by_name_and_by_file(tools: Path) -> None:
    assert find_scene("demo").summary == "A straight flight over a plain."
    assert find_scene(str(tools / "scenes/outdoor.yaml")).name == "outdoor"
    for name in ("moon", "moon.yaml"):
        with pytest.raises(InputError, match=f"{name}: no such scene.*one of demo, outdoor"):
            find_scene(name)


def _simulate(tools: Path, seed: int = 1) -> Path:
    return pipeline.simulate(_steps(), find_scene("demo"), seed, tools / "simulate.log")


def test_a_flight_that_is_there_is_used_again(tools: Path) -> None:
    flight = _simulate(tools)
    assert flight == tools / "flights/demo-1"
    kept.mark(flight, find_scene("demo").origin(1))
    assert _simulate(tools) == flight
    assert _calls(tools) == ["simulate"]
    _simulate(tools, seed=2)
    (tools / "scenes/demo.yaml").write_text(SCENE.replace("duration_s: 9", "duration_s: 8"))
    _simulate(tools)
    assert _calls(tools) == ["simulate"] * 3


def test_flown_both_ways_and_judged(tools: Path) -> None:
    folders = Folders(tools / "work")
    flight = _simulate(tools)
    pipeline.fly(_steps(), "demo", flight, folders)
    assert _calls(tools) == ["range", "simulate", "vio"]
    outcome = pipeline.judge("demo", 1, flight, folders)
    assert outcome.range_vio is not None and outcome.vio is not None
    assert outcome.vio.headline.max_axis_percent == pytest.approx(10.0, abs=0.1)
    assert outcome.range_vio.headline.max_axis_m < 1e-6
    assert Outcome.from_json(outcome.as_json()) == outcome


def test_filter_that_never_started_is_named(tools: Path) -> None:
    folders = Folders(tools / "work")
    flight = _simulate(tools)
    pipeline.fly(_steps(), "demo", flight, folders)
    made_flight.never_start(folders.run("VIO"))
    outcome = pipeline.judge("demo", 1, flight, folders)
    assert outcome.vio is None
    assert outcome.reasons["VIO"].startswith("never started: none of 120 images has a state; without range, only")
    (note,) = footnotes([outcome])
    assert note.startswith("demo, VIO: never started: ") and note.endswith("rather than a wrong one.")
    made_flight.never_start(folders.run("range-VIO"))
    reason = pipeline.judge("demo", 1, flight, folders).reasons["range-VIO"]
    assert reason == "never started: none of 120 images has a state"


def test_replay_without_a_solution_is_told_not_hidden(tools: Path) -> None:
    folders = Folders(tools / "work")
    flight = _simulate(tools)
    pipeline.fly(_steps(), "demo", flight, folders)
    (folders.run("VIO") / "trajectory.tum").write_text("")
    outcome = pipeline.judge("demo", 1, flight, folders)
    assert outcome.vio is None and "holds no data line" in outcome.reasons["VIO"]
    assert {cell(outcome.vio, column) for column in COLUMNS} == {"-"}
    assert error_ratio([outcome]) is None


def test_tool_that_fails_is_named_with_its_last_words(tools: Path) -> None:
    _program(tools / "simulate", "echo 'scene.gravity: negative'; exit 2")
    with pytest.raises(StepFailed, match=r"ended with 2:\n  scene.gravity: negative") as failure:
        _simulate(tools)
    assert "simulate.log" in str(failure.value)


def test_where_no_terminal_is_lines_tell_how_far_a_step_is(
    tools: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(heartbeat, "PERIOD_S", 0.1)
    _program(tools / "slow", "sleep 0.35; echo '[3/10] Building'; sleep 0.35")
    with Steps(Console()).step("build") as step:
        step.run("configure", ["true"], tools / "configure.log")
        step.run("compile", [tools / "slow"], tools / "build.log")
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("    ")]
    assert lines[0].startswith("    compile, 0 s") and lines[-1].startswith("    compile 30 %, ")
    assert 4 <= len(lines) <= 8


def test_replay_that_fails_ends_the_other(tools: Path) -> None:
    _program(tools / "plumb-replay", '[[ "$*" == *--no-range* ]] || { echo "no imu0"; exit 2; }; exec sleep 600')
    with pytest.raises(StepFailed, match="no imu0"):
        pipeline.fly(_steps(), "demo", tools / "made/flight", Folders(tools / "work"))


def test_mean_and_worst_of_signed_figures_go_by_size(tools: Path) -> None:
    folders = Folders(tools / "work")
    flight = _simulate(tools)
    pipeline.fly(_steps(), "demo", flight, folders)
    large = pipeline.judge("demo", 1, flight, folders).vio
    shutil.rmtree(tools / "made/vio")
    made_flight.write_run(tools / "made/vio", scale=0.98, with_range=False)
    pipeline.fly(_steps(), "demo", flight, folders)
    small = pipeline.judge("demo", 2, flight, folders).vio
    assert large is not None and small is not None
    scale = next(column for column in COLUMNS if column.signed)
    assert mean_and_worst([small, large], scale) == pytest.approx((6.0, 10.0), abs=0.01)


@pytest.mark.parametrize("width", [80, 128])
def test_the_table_fits_the_terminal(tools: Path, capsys: pytest.CaptureFixture[str], width: int) -> None:
    flight = _simulate(tools)
    pipeline.fly(_steps(), "demo", flight, Folders(tools / "work"))
    outcome = replace(pipeline.judge("demo", 1, flight, Folders(tools / "work")), scene="excitation")
    Console(width=width).print(terminal_table([outcome], width))
    text = capsys.readouterr().out
    assert "excitation" in text and "10.00" in text and "…" not in text
    Console(width=width).print(terminal_table([replace(outcome, vio=None, reasons={"VIO": "never started: x"})], width))
    text = capsys.readouterr().out
    rows = [line.split() for line in text.splitlines()]
    assert ["VIO", "never"] in rows and ["started"] in rows and "…" not in text


def test_demo_flies_a_recording_and_leaves_a_report(
    tools: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pipeline, "build", lambda steps, out: None)
    flight = tools / "made/flight"
    assert demo.main(["--flight", str(flight), "--out", str(tools / "out"), "--no-open"]) == 0
    text = capsys.readouterr().out
    for part in ("set up", "fly flight", "score and report", "everything", "range-VIO", "VIO", "report.html"):
        assert part in text
    assert (tools / "out/flight/report.html").is_file()


def test_demo_names_no_report_that_it_did_not_write(
    tools: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pipeline, "build", lambda steps, out: None)
    for run in ("range", "vio"):
        made_flight.never_start(tools / "made" / run)
    old = tools / "out/flight/report.html"
    old.parent.mkdir(parents=True)
    old.write_text("of another flight")
    assert demo.main(["--flight", str(tools / "made/flight"), "--out", str(tools / "out"), "--no-open"]) == 0
    told = capsys.readouterr().out
    assert "report.html" not in told and "no report: there is no replay with a state" in told
    assert told.count("never started: none of 120 images") == 2 and not old.exists()


def test_demo_shows_a_recording_without_truth(
    tools: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pipeline, "build", lambda steps, out: None)
    monkeypatch.setattr(demo, "DEFAULT_IMAGES", 2)
    flight = tools / "made/flight"
    (flight / "mav0/state_groundtruth_estimate0/data.csv").unlink()
    assert demo.main(["--flight", str(flight), "--out", str(tools / "out"), "--no-open"]) == 0
    told = capsys.readouterr().out
    assert "flight, VIO: no truth: " in told and "report.html" in told
    assert (tools / "out/flight/report.html").is_file()


def test_full_demo_flies_every_scene(
    tools: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pipeline, "build", lambda steps, out: None)
    monkeypatch.setattr(demo, "DEFAULT_IMAGES", 2)
    assert demo.main(["--full", "--out", str(tools / "out"), "--no-open"]) == 0
    assert _calls(tools).count("simulate") == 2
    assert "outdoor" in capsys.readouterr().out


def test_demo_tells_bad_input_in_a_line(tools: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert demo.main(["--flight", str(tools), "--no-open"]) == 2
    assert f"demo: --flight {tools}: holds no mav0" in capsys.readouterr().err
    assert demo.main(["--out", str(tools / "plumb-replay"), "--no-open"]) == 2
    assert f"demo: --out {tools / 'plumb-replay'}: cannot be written" in capsys.readouterr().err


def test_replay_that_is_not_built_is_a_failed_step(tools: Path) -> None:
    os.remove(tools / "plumb-replay")
    with pytest.raises(StepFailed, match="not built"):
        pipeline.fly(_steps(), "demo", tools / "made/flight", Folders(tools / "work"))
