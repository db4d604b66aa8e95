"""The summary of a test run counts every outcome under its kind."""

import json
from pathlib import Path

import pytest
from plumb_tools import run_summary
from plumb_tools.fuzz import Outcome, junit

# As CTest 3.25 and pytest write them, shortened.
CTEST = """<testsuite>
  <testcase name="A" status="run"/>
  <testcase name="B" status="fail"><failure message=""/></testcase>
  <testcase name="C" status="notrun"><skipped message="SKIP_REGULAR_EXPRESSION_MATCHED"/>
    <system-out>[ RUN      ] C
/build/replay_test.cpp:12: Skipped
recorded data not found
[  SKIPPED ] C (0 ms)</system-out></testcase>
</testsuite>"""
PYTHON = """<testsuites><testsuite><testcase name="a"/><testcase name="b"><error message="x"/></testcase>
  <testcase name="c"><skipped message="no display"/></testcase></testsuite></testsuites>"""


def listing(**labels: str) -> str:
    """What `ctest --show-only=json-v1` says of these tests."""
    properties = {name: [{"name": "LABELS", "value": [label]}] for name, label in labels.items()}
    return json.dumps({"tests": [{"name": name, "properties": value} for name, value in properties.items()]})



def test_counts_by_kind_and_names_the_reason_to_skip(tmp_path: Path) -> None:
    (tmp_path / "ctest-flight.xml").write_text(CTEST)
    (tmp_path / "ctest-flight.json").write_text(listing(A="unit", B="law", C="replay"))
    (tmp_path / "ctest-sanitize.xml").write_text(CTEST)
    (tmp_path / "python.xml").write_text(PYTHON)
    (tmp_path / "target.xml").write_text(PYTHON)
    found = [Outcome("fuzz_a", 1, 1, 1, 1, None), Outcome("fuzz_b", 1, 1, 1, 1, "findings/fuzz_b-crash-0af1")]
    (tmp_path / "fuzz.xml").write_text(junit(found))
    lines = run_summary.summary_lines(run_summary.read_reports(tmp_path))
    assert lines == [
        "unit     1 passed",
        "law      1 failed",
        "replay   1 skipped",
        "         skipped 1: recorded data not found",
        "campaign not run",
        "target   1 failed, 1 passed, 1 skipped",
        "         skipped 1: no display",
        "check    not run",
        "python   1 failed, 1 passed, 1 skipped",
        "         skipped 1: no display",
        "fuzz     1 failed, 1 passed",
        "sanitize 1 failed, 1 passed, 1 skipped",
        "         skipped 1: recorded data not found",
        "5 passed, 5 failed, 4 skipped",
    ]


@pytest.mark.parametrize(
    ("report", "code"),
    [
        ("<testsuite><testcase name='a'/></testsuite>", 0),
        ("<testsuite><testcase name='a'/><testcase name='b'><failure/></testcase></testsuite>", 1),
        ("<testsuite/>", 1),
        ("<testsuite><testcase name='a'><skipped message=''/></testcase></testsuite>", 1),
    ],
)
def test_passes_only_when_something_ran_and_nothing_failed(tmp_path: Path, report: str, code: int) -> None:
    (tmp_path / "ctest-flight.xml").write_text(report)
    (tmp_path / "ctest-flight.json").write_text(listing(a="unit", b="check"))
    assert run_summary.main([str(tmp_path)]) == code
