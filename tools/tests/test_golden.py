"""The same inputs give the same bits as when the hashes of short flights were kept."""

from __future__ import annotations

from pathlib import Path

import pytest

from plumb_tools import golden
from plumb_tools.trajectory import InputError

HINT = "if that is wanted: tools/golden --accept, in a commit that says why"


@pytest.mark.skipif(not (golden.BIN / "plumb-montecarlo").exists(), reason="plumb-montecarlo is not built")
def test_simulated_flights_give_the_bits_they_gave() -> None:
    seen = golden.simulated()
    assert len(seen) == 2 * len(golden.SCENES)
    assert golden.differences(seen, golden.read_golden()) == [], HINT


def test_a_recorded_flight_gives_the_bits_it_gave(euroc_mh01: Path) -> None:
    assert golden.differences(golden.recorded(euroc_mh01), golden.read_golden()) == [], HINT


def test_what_differs_or_is_not_known_is_named() -> None:
    told = golden.differences({"a": "1", "b": "2", "c": "3"}, {"a": "1", "b": "9", "d": "4"})
    assert told == ["b: 2, expected 9", "c: 3, expected none"]


@pytest.mark.parametrize("text", ["", "[]", '{"a": 1}'])
def test_a_file_without_hashes_is_named(text: str, tmp_path: Path) -> None:
    file = tmp_path / "golden.json"
    file.write_text(text)
    with pytest.raises(InputError, match=r"golden\.json"):
        golden.read_golden(file)
