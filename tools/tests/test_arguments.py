"""Bad values on a command line are refused with what was expected, and never with a name from within a program."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from plumb_tools.demo.__main__ import main as demo
from plumb_tools.mavlink.__main__ import main as bridge
from plumb_tools.report.__main__ import main as report
from plumb_tools.score.__main__ import main as score
from plumb_tools.sim.__main__ import main as simulate

Program = Callable[[list[str]], int]

SECONDS, LENGTH = "a number of seconds", "a positive number of seconds"
COUNT, SEED = "a whole number from 1 to 400", "a whole number of at least 0"

BAD: list[tuple[Program, list[str], str, str]] = [
    (simulate, ["demo"], "--duration -1", LENGTH),
    (simulate, ["demo"], "--duration abc", LENGTH),
    (simulate, ["demo"], "--duration inf", LENGTH),
    (simulate, ["demo"], "--seed 1.5", SEED),
    (demo, [], "--seed -1", SEED),
    (demo, [], "--seed one", SEED),
    (score, ["a", "b"], "--start soon", SECONDS),
    (score, ["a", "b"], "--end nan", SECONDS),
    (score, ["a", "b"], "--max-time-diff 0", LENGTH),
    (score, ["--suite"], "--seeds 0", "a whole number of at least 1"),
    (score, ["--suite"], "--seeds few", "a whole number of at least 1"),
    (report, ["a", "--flight", "b"], "--images 0", COUNT),
    (report, ["a", "--flight", "b"], "--images 401", COUNT),
    (report, ["a", "--flight", "b"], "--images many", COUNT),
    (bridge, ["--connect", "a"], "--rate 0", "a positive number"),
    (bridge, ["--connect", "a"], "--rate often", "a positive number"),
    (bridge, ["--connect", "a"], "--system 256", "a whole number from 1 to 255"),
    (report, ["a", "--flight", "b"], "--animation a.mp4", "a name that ends in .webp or .gif"),
]


@pytest.mark.parametrize(("program", "words", "option", "expected"), BAD, ids=[row[2] for row in BAD])
def test_bad_values_are_refused_in_plain_words(
    program: Program, words: list[str], option: str, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    name, value = option.split()
    with pytest.raises(SystemExit) as stop:
        program([*words, f"{name}={value}"])
    assert stop.value.code == 2
    assert capsys.readouterr().err.rstrip().endswith(f"argument {name}: {value!r}; expected {expected}")
