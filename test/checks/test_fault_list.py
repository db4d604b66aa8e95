"""docs/faults.md promises a test for each fault: every test it names is there, and every fault names one."""

import re

from sources import ROOT

FAULTS = (ROOT / "docs" / "faults.md").read_text(encoding="utf-8")
_ROW = re.compile(r"^\| (F\d+) \|.*\| ([^|]*) \|$", re.MULTILINE)
_TEST = re.compile(r"^TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\s*\)", re.MULTILINE)


def names_in(text: str) -> set[str]:
    """The tests named in backticks, as CTest lists them: Suite.Name or check.name."""
    return set(re.findall(r"`((?:[A-Z]\w*|check)\.\w+)`", text))


def known_tests() -> set[str]:
    """Every GoogleTest case and every check of the house below test."""
    folder = ROOT / "test"
    cases = {
        ".".join(case) for file in folder.rglob("*_test.cpp") for case in _TEST.findall(file.read_text(encoding="utf-8"))
    }
    checks = re.findall(r"^\s*plumb_check\((\w+)", (folder / "checks/CMakeLists.txt").read_text(), re.MULTILINE)
    return cases | {f"check.{name}" for name in checks}


def test_every_named_test_exists() -> None:
    named = names_in(FAULTS)
    assert len(named) > 50
    assert named - known_tests() == set()


def test_a_test_that_is_not_there_is_noticed() -> None:
    assert names_in("`Faults.F99NoSuchThing`, `check.nothing`, `cmake/Plumb.cmake`") - known_tests() == {
        "Faults.F99NoSuchThing",
        "check.nothing",
    }


def test_every_fault_has_its_proof() -> None:
    rows = _ROW.findall(FAULTS)
    assert [name for name, _ in rows] == [f"F{k}" for k in range(1, len(rows) + 1)]
    assert len(rows) == 30
    without = [name for name, proof in rows if not names_in(proof)]
    assert without == []
