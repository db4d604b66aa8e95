"""What the flight software costs stays within its budgets, and the command tells when it does not."""

from __future__ import annotations

from pathlib import Path

import pytest

from plumb_tools.budget.__main__ import BUDGETS, Budget, accept, read_budgets, verdict
from plumb_tools.budget.figures import Figure, replayed, said_at_the_end, sections, stacks
from plumb_tools.demo.pipeline import ROOT
from plumb_tools.trajectory import InputError

BUILD = ROOT / "build" / "flight"


def _wrong(figures: list[Figure]) -> dict[str, str]:
    budgets = read_budgets(BUDGETS)
    return {figure.key: told for figure in figures if (told := verdict(figure, budgets.get(figure.key))) is not None}


@pytest.mark.skipif(not (BUILD / "bin" / "plumb-fsw").exists(), reason="plumb-fsw is not built")
def test_memory_and_stacks_are_within_budget() -> None:
    figures = [*sections(BUILD), *stacks(BUILD)]
    assert {figure.key for figure in figures} == {
        key for key in read_budgets(BUDGETS) if not key.startswith(("arm64.", "faults.", "heap.", "memory.", "thread."))
    }
    assert _wrong(figures) == {}


def test_memory_and_every_thread_of_a_flight_have_a_budget() -> None:
    said = (
        "memory at most 24.5 MiB\n"
        "thread imu     stack used 5816 of 262144 bytes, page faults 0\n"
        "thread nav     stack used 999999 of 9 bytes, page faults 33\n"
        "heap calls of thread plumb-fsw: 3952\n"
        "heap calls of thread nav: 5\n"
        "heap calls of thread command: 7\n"
    )
    figures = list(said_at_the_end(said))
    assert [(figure.key, figure.value) for figure in figures] == [
        ("memory.flight", 24.5 * 2**20),
        ("thread.imu", 5816.0),
        ("thread.nav", 999999.0),
        ("faults.flight", 33.0),
        ("heap.flight", 5.0),
    ]
    assert _wrong(figures) == dict.fromkeys(("memory.flight", "thread.nav", "faults.flight", "heap.flight"), "over budget")


def test_a_recorded_flight_takes_no_heap_and_little_memory(euroc_mh01: Path) -> None:
    assert _wrong(list(replayed(euroc_mh01))) == {}


@pytest.mark.parametrize(
    ("value", "budget", "expected"),
    [
        (100.0, Budget(100.0, 100.0), None),
        (101.0, Budget(100.0, None), "over budget"),
        (98.0, Budget(100.0, 96.0), "was 96, +2.1 %"),
        (50.0, Budget(100.0, 96.0), "was 96, -47.9 %"),
        (1.0, Budget(0.0, 0.0), "over budget"),
        (50.0, Budget(100.0, None), None),
        (98.0, Budget(100.0, 96.0, 0.03), None),
        (99.0, Budget(100.0, 96.0, 0.03), "was 96, +3.1 %"),
        (50.0, None, "has no budget"),
    ],
)
def test_verdict(value: float, budget: Budget | None, expected: str | None) -> None:
    assert verdict(Figure("key", "what", value), budget) == expected


def test_accepting_keeps_comments_and_what_was_not_measured(tmp_path: Path) -> None:
    file = tmp_path / "budgets.yaml"
    file.write_text("# why\na: {most: 9, reviewed: 1}\nb: {most: 9, reviewed: null}\nc: {most: 9, reviewed: 3, within: 0.1}\n")
    assert read_budgets(file) == {"a": Budget(9, 1), "b": Budget(9, None), "c": Budget(9, 3, 0.1)}
    accept([Figure("a", "", 5.0), Figure("b", "", 6.0)], file)
    assert file.read_text() == (
        "# why\na: {most: 9, reviewed: 5}\nb: {most: 9, reviewed: null}\nc: {most: 9, reviewed: 3, within: 0.1}\n"
    )
    accept([Figure("c", "", 4.0)], file)
    assert "c: {most: 9, reviewed: 4, within: 0.1}\n" in file.read_text()


@pytest.mark.parametrize("text", ["a: 5", "a: {most: much, reviewed: 1}", "a: {most: 1}", "[", ""])
def test_a_file_without_budgets_is_named(text: str, tmp_path: Path) -> None:
    file = tmp_path / "budgets.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=r"budgets\.yaml: expected lines of KEY"):
        read_budgets(file)
