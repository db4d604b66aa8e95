"""What the scorer prints and writes, from files to figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plumb_tools.score.__main__ import main
from plumb_tools.trajectory import read_truth
from synthetic import flight, moved, write_asl, write_replay, write_tum, yaw


@pytest.fixture
def replay(tmp_path: Path) -> tuple[Path, Path]:
    """An ASL folder and a replay of it that is exact but for its world frame."""
    truth = flight()
    est = moved(truth, yaw(45.0), (1.0, 2.0, 3.0))
    return write_asl(tmp_path / "asl", truth), write_replay(tmp_path / "out", est, 1e-4 * np.eye(9))


def test_json_has_all_figures_and_only_finite_numbers(replay: tuple[Path, Path], tmp_path: Path) -> None:
    target = tmp_path / "score.json"
    assert main([*map(str, replay), "--json", str(target)]) == 0

    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is not JSON")

    figures = json.loads(target.read_text(), parse_constant=refuse)
    assert not list(tmp_path.glob(".part*"))
    assert figures["schema"] == "plumb-score/1"
    assert figures["span_source"] == "images"
    assert figures["alignments"]["4dof"]["ate_rmse_m"] < 1e-8
    assert figures["alignments"]["start"]["velocity_rmse_m_s"] < 1e-8
    assert figures["coverage"]["covered"] == pytest.approx(1.0)
    for part in ("position", "velocity", "attitude"):
        assert figures["consistency"][part]["mean"] < 1e-8
        assert figures["consistency"][part]["samples"] == 399
    assert figures["standstill"] is None


def test_json_on_standard_output_is_all_that_is_printed(
    replay: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*map(str, replay), "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["pairs"] == 400


def test_table_is_printed_whole(replay: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*map(str, replay), "--align", "none"]) == 0
    text = capsys.readouterr().out
    for part in (
        "ATE RMSE, m",
        "start",
        "4-dof",
        "SE(3)",
        "Sim(3)",
        "given",
        "velocity RMSE",
        "NEES",
        "coverage of images",
    ):
        assert part in text
    assert "…" not in text


@pytest.mark.parametrize("selected", ["4dof", "none"])
def test_plot_is_a_picture(replay: tuple[Path, Path], tmp_path: Path, selected: str) -> None:
    target = tmp_path / "score.png"
    assert main([*map(str, replay), "--align", selected, "--plot", str(target)]) == 0
    assert target.read_bytes().startswith(b"\x89PNG")
    assert target.stat().st_size > 20_000


def test_tum_files_alone_are_scored(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = write_tum(tmp_path / "truth.tum", flight())
    assert main([str(truth), str(truth), "--json", "-"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["consistency"] is None
    assert figures["alignments"]["4dof"]["velocity_rmse_m_s"] is None


def test_trajectory_of_a_replay_is_scored_with_what_lies_beside_it(
    replay: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    truth, folder = replay
    (folder / "summary.json").write_text("{}")

    def figures(estimate: Path) -> dict[str, Any]:
        assert main([str(truth), str(estimate), "--json", "-"]) == 0
        return json.loads(capsys.readouterr().out)

    whole, by_file = figures(folder), figures(folder / "trajectory.tum")
    assert "beside" in by_file["notes"][0] and "same replay" in by_file["notes"][0]
    assert {**by_file, "notes": whole["notes"]} == whole
    states = (folder / "states.csv").read_text()
    (folder / "states.csv").write_text("".join(states.splitlines(keepends=True)[:40]))
    other = figures(folder / "trajectory.tum")
    assert other["consistency"] is None and "do not belong to it: " in other["notes"][0]
    (folder / "summary.json").unlink()
    assert figures(folder / "trajectory.tum")["notes"] == []


def test_replay_that_never_started_is_called_that(
    replay: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    truth, folder = replay
    (folder / "trajectory.tum").write_text("")
    summary = {"images_processed": 30, "images_valid": 0, "inputs": {"ranges": 9}}
    (folder / "summary.json").write_text(json.dumps(summary))
    assert main([str(truth), str(folder)]) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"score: {folder}: never started: none of 30 images has a state; expected"), told


def test_estimate_that_never_moves_is_scored(tmp_path: Path) -> None:
    truth = flight()
    still = moved(truth, yaw(0.0), (0.0, 0.0, 0.0), scale=0.0)
    files = [write_tum(tmp_path / "truth.tum", truth), write_tum(tmp_path / "still.tum", still)]
    assert main([*map(str, files), "--align", "sim3", "--plot", str(tmp_path / "still.png")]) == 0


def test_help_has_examples(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    assert "examples:" in capsys.readouterr().out


def test_recorded_truth_scored_against_itself_is_without_error(
    euroc_mh01: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truth = read_truth(euroc_mh01)
    est = write_tum(tmp_path / "est.tum", truth.trajectory)
    assert main([str(euroc_mh01), str(est), "--json", "-"]) == 0
    figures = json.loads(capsys.readouterr().out)
    for name in ("start", "4dof", "se3", "sim3"):
        assert figures["alignments"][name]["ate_max_m"] < 1e-6
        assert figures["alignments"][name]["tilt_max_deg"] < 1e-4
        assert abs(figures["alignments"][name]["heading_final_deg"]) < 1e-4
    assert figures["scale"] == pytest.approx(1.0, abs=1e-6)
    assert figures["coverage"]["covered"] == pytest.approx(1.0, abs=1e-3)
    assert figures["distance_m"] == pytest.approx(5.4, abs=0.2)
    assert figures["standstill"]["duration_s"] == pytest.approx(14.5, abs=1.0)
