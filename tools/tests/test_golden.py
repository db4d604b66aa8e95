"""The same inputs give the same bits as when the hashes of short flights were kept."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from plumb_tools import golden
from plumb_tools.trajectory import InputError

HINT = "if that is wanted: tools/golden --accept, in a commit that says why"


@pytest.mark.skipif(not (golden.BIN / "plumb-montecarlo").exists(), reason="plumb-montecarlo is not built")
def test_simulated_flights_give_the_bits_they_gave() -> None:
    seen = golden.simulated()
    assert len(seen) == 2 * len(golden.SCENES)
    assert golden.differences(seen, golden.read_golden(golden.GOLDEN)) == [], HINT


def test_a_recorded_flight_gives_the_bits_it_gave(euroc_mh01: Path) -> None:
    assert golden.differences(golden.recorded(euroc_mh01), golden.read_golden(golden.GOLDEN)) == [], HINT


def test_what_differs_or_is_not_known_is_named() -> None:
    told = golden.differences({"a": "1", "b": "2", "c": "3"}, {"a": "1", "b": "9", "d": "4"})
    assert told == ["b: 2, expected 9", "c: 3, expected none"]


def test_what_is_accepted_is_told_and_not_asked_for_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "golden.json"
    file.write_text('{"a": "1", "b": "2", "d": "4"}')
    monkeypatch.setattr(golden, "GOLDEN", file)
    monkeypatch.setattr(golden, "simulated", lambda: {"a": "1", "b": "9"})
    arguments = ["--recording", str(tmp_path / "none")]
    assert golden.main(arguments) == 1
    assert json.loads(file.read_text())["b"] == "2"
    assert golden.main([*arguments, "--accept"]) == 0
    assert capsys.readouterr().out == "golden: 2 flights, kept 1 other hashes\n  b: 9, expected 2\n"
    assert json.loads(file.read_text()) == {"a": "1", "b": "9", "d": "4"}
    assert golden.main(arguments) == 0
    assert capsys.readouterr().out == "golden: 2 flights, all hashes as before\n"


@pytest.mark.parametrize("text", ["", "[]", '{"a": 1}'])
def test_a_file_without_hashes_is_named(text: str, tmp_path: Path) -> None:
    file = tmp_path / "golden.json"
    file.write_text(text)
    with pytest.raises(InputError, match=r"golden\.json"):
        golden.read_golden(file)
