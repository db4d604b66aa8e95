"""The table of what each feature of the estimator brings."""

from __future__ import annotations

from pathlib import Path

import pytest
from plumb_tools import ablation
from plumb_tools.ablation import PROGRAM, VARIANTS, Cell

HEAD = "scene,filter,seed,started,diverged,worst_axis_percent,sim3_scale_percent,nees_position_100\n"


def _cell(tmp_path: Path, rows: str) -> Cell:
    file = tmp_path / "table.csv"
    file.write_text(HEAD + rows)
    return ablation.read_cell(file)


def test_a_cell_is_the_mean_of_the_sizes(tmp_path: Path) -> None:
    cell = _cell(tmp_path, "hover,range-vio,1,1,0,0.2,-0.3,4\nhover,range-vio,2,1,1,0.4,0.1,nan\n")
    assert cell.text() == "0.30, 0.200 (4.0), 1 diverged"


def test_flights_that_never_started_are_told_and_do_not_count(tmp_path: Path) -> None:
    rows = "hover,range-vio,1,1,0,0.2,0.1,3\nhover,range-vio,2,0,0,nan,nan,nan\n"
    assert _cell(tmp_path, rows).text() == "0.20, 0.100 (3.0), 1 never started"
    assert _cell(tmp_path, "hover,range-vio,2,0,0,nan,nan,nan\n").text() == "-"


@pytest.mark.skipif(not PROGRAM.exists(), reason="plumb-montecarlo is not built")
def test_every_setting_is_one_that_the_estimator_knows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # All at once in one flight: a name that is misspelt, or a value out of range, ends the program.
    everything = ablation.Variant("all", tuple(text for variant in VARIANTS for text in variant.settings))
    monkeypatch.setattr(ablation, "VARIANTS", (everything,))
    monkeypatch.setattr(ablation.pipeline, "build", lambda *_: None)
    out = tmp_path / "ablation.md"
    assert ablation.main(["--scenes", "hover", "--seeds", "1", "--out", str(out), "--work", str(tmp_path / "work")]) == 0
    assert "| all `range.feature=0`" in out.read_text()


def test_a_page_that_cannot_be_written_is_told_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    assert ablation.main(["--out", str(folder)]) == 2
    assert "expected the name of a file" in capsys.readouterr().err
