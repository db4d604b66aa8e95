"""A recorded flight, started in motion without truth, must be as accurate as Plumb says it is."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from plumb_tools.report.headline import headline_of
from plumb_tools.trajectory import read_truth

ROOT = Path(__file__).resolve().parents[2]
REPLAY = ROOT / "build" / "flight" / "bin" / "plumb-replay"

sys.path.insert(0, str(ROOT / "test" / "budget"))
from light_change import LIGHTS, in_light  # noqa: E402
from tracker_comparison import fly  # noqa: E402

MIN_COVERAGE = 0.98  # of the image span
MAX_STANDSTILL_DRIFT_M = 0.02


@pytest.mark.parametrize(("options", "max_ate_m"), [([], 0.008), (["--no-range"], 0.007)], ids=["range", "no-range"])
def test_euroc_mh01_is_flown_within_millimetres(
    euroc_mh01: Path, tmp_path: Path, options: list[str], max_ate_m: float
) -> None:
    if not REPLAY.is_file():
        pytest.skip("plumb-replay is not built: cmake --preset flight && cmake --build --preset flight")
    out = tmp_path / "out"
    subprocess.run([REPLAY, "--asl", euroc_mh01, "--out", out, *options], check=True, capture_output=True)
    scores = tmp_path / "scores.json"
    score = [ROOT / "tools" / "score", euroc_mh01, out / "trajectory.tum", "--json", scores]
    subprocess.run(score, check=True, capture_output=True)
    figures = json.loads(scores.read_text(encoding="utf-8"))
    assert figures["alignments"]["4dof"]["ate_rmse_m"] < max_ate_m
    assert figures["coverage"]["covered"] >= MIN_COVERAGE
    assert figures["standstill"]["duration_s"] > 10.0
    assert figures["standstill"]["drift_m"] < MAX_STANDSTILL_DRIFT_M


def test_light_that_changes_at_once_costs_no_accuracy(euroc_mh01: Path, tmp_path: Path) -> None:
    if not REPLAY.is_file():
        pytest.skip("plumb-replay is not built: cmake --preset flight && cmake --build --preset flight")
    recording = in_light(euroc_mh01, LIGHTS["every other ten images at 0.6"], tmp_path / "recording")
    run = fly(REPLAY, recording, tmp_path / "out", "tracker:\n  light_change: 1\n")
    headline, _ = headline_of(read_truth(euroc_mh01), run)
    assert headline.ate_m < 0.008
    assert headline.resets == 0
