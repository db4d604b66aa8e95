"""What tools/fuzz makes of libFuzzer and of its output."""

from __future__ import annotations

import shutil
import subprocess
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from plumb_tools import fuzz
from plumb_tools.demo.process import Steps
from plumb_tools.fuzz import Outcome, outcome_of
from rich.console import Console

COMPILER = "clang++-19"
REPLAY = Path(__file__).parents[2] / "build/flight/bin/plumb-replay"
# Breaks on any input that begins with B.
TARGET = """\
#include <cstddef>
#include <cstdint>
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (BREAKS && size > 0 && data[0] == 'B') __builtin_trap();
  return 0;
}
"""

QUIET = """\
#2\tINITED cov: 11 ft: 12 corp: 1/1b exec/s: 0 rss: 30Mb
#1048576\tpulse  cov: 262 ft: 819 corp: 196/8046b lim: 4096 exec/s: 262144 rss: 60Mb
artifact_prefix='findings/fuzz_x-'; Test unit written to findings/fuzz_x-slow-unit-0c11
Done 1500000 runs in 6 second(s)
stat::number_of_executed_units: 1500000
stat::average_exec_per_sec:     250000
"""
BROKEN = """\
#77\tNEW    cov: 40 ft: 50 corp: 9/80b lim: 4 exec/s: 0 rss: 30Mb
==9==ERROR: AddressSanitizer: heap-buffer-overflow
artifact_prefix='findings/fuzz_x-'; Test unit written to findings/fuzz_x-crash-0af1
stat::number_of_executed_units: 90
stat::average_exec_per_sec:     90
"""


def test_a_run_that_found_nothing() -> None:
    assert outcome_of("fuzz_x", QUIET) == Outcome("fuzz_x", 1_500_000, 250_000, 262, 196, None)


def test_a_run_that_found_something() -> None:
    assert outcome_of("fuzz_x", BROKEN) == Outcome("fuzz_x", 90, 90, 40, 9, "findings/fuzz_x-crash-0af1")


@pytest.mark.skipif(not REPLAY.exists(), reason="plumb-replay is not built")
def test_the_log_to_begin_with_is_one_that_flies() -> None:
    """A seed with parameters that are no more would keep the fuzzer before the door."""
    log = fuzz.SEEDS / "fuzz_log" / "one_image"
    done = subprocess.run([REPLAY, "--log", log], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(shutil.which(COMPILER) is None, reason=f"{COMPILER} is not installed: tools/setup --fuzz")
def test_runs_side_by_side_name_what_broke_and_leave_the_seeds_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    build, seeds = tmp_path / "build", tmp_path / "seeds"
    monkeypatch.setattr(fuzz, "BUILD", build)
    monkeypatch.setattr(fuzz, "SEEDS", seeds)
    (build / "bin").mkdir(parents=True)
    (tmp_path / "target.cpp").write_text(TARGET)
    for name, breaks in (("fuzz_breaks", 1), ("fuzz_holds", 0)):
        options = ["-fsanitize=fuzzer", f"-DBREAKS={breaks}", "-o", build / "bin" / name]
        subprocess.run([COMPILER, *options, tmp_path / "target.cpp"], check=True)
        (seeds / name).mkdir(parents=True)
        (seeds / name / "seed").write_text("A")
    outcomes = fuzz.run_all(Steps(Console(quiet=True)), fuzz.targets(), seconds=2, seed=1, jobs=2)
    breaks, holds = outcomes
    assert holds.finding is None
    assert breaks.finding is not None
    assert Path(breaks.finding).read_bytes().startswith(b"B")
    assert sorted(path.name for path in seeds.rglob("*") if path.is_file()) == ["seed", "seed"]
    cases = ElementTree.fromstring(fuzz.junit(outcomes)).findall("testcase")
    assert [case.find("failure") is None for case in cases] == [False, True]
    assert "-seed=1" in (build / "fuzz_holds.log").read_text()


def test_a_run_that_died_without_an_input_is_a_finding(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fuzz, "BUILD", tmp_path)
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "fuzz_dies").symlink_to(shutil.which("false") or "/bin/false")
    (outcome,) = fuzz.run_all(Steps(Console(quiet=True)), ["fuzz_dies"], seconds=1, seed=1, jobs=1)
    assert outcome.finding == str(tmp_path / "fuzz_dies.log")
