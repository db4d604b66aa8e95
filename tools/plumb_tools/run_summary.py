"""The last lines of tools/test: how many tests of each kind passed, failed and were skipped.

    python -m plumb_tools.run_summary REPORTS

REPORTS is a folder of JUnit files, ctest-<preset>.xml, python.xml, target.xml and fuzz.xml. Beside each of CTest's lies ctest-<preset>.json,
what `ctest --show-only=json-v1` prints, because only there the tests have their labels.
Exits with 1 when a test failed or when nothing was run.
"""

import json
import sys
import xml.etree.ElementTree as ElementTree
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

KINDS = ("unit", "law", "replay", "campaign", "target", "check", "python", "fuzz", "sanitize")


@dataclass
class Tally:
    """Outcomes of one kind of test."""

    outcomes: Counter = field(default_factory=Counter)
    skip_reasons: Counter = field(default_factory=Counter)


def outcome_of(case: ElementTree.Element) -> str:
    """passed, failed or skipped, as CTest and pytest write it."""
    if case.find("failure") is not None or case.find("error") is not None:
        return "failed"
    # CTest gives a test that could not be run the status "notrun" or "disabled", like one that skipped itself.
    if case.find("skipped") is not None:
        return "skipped"
    return "passed"


def skip_reason(case: ElementTree.Element) -> str:
    """What the test itself said: the line after GoogleTest's "Skipped", or pytest's message."""
    lines = [line.strip() for line in (case.findtext("system-out") or "").splitlines()]
    for line, following in zip(lines, lines[1:]):
        if line.endswith("Skipped") and following:
            return following
    return case.find("skipped").get("message") or "no reason given"


def labels_of(listing: Path) -> dict[str, str]:
    """The kind of every test in a CTest listing, by name."""
    kinds = {}
    for test in json.loads(listing.read_text(encoding="utf-8"))["tests"]:
        labels = [p["value"] for p in test.get("properties", []) if p["name"] == "LABELS"]
        kinds[test["name"]] = next((label for label in sum(labels, []) if label in KINDS), "unit")
    return kinds


def read_reports(folder: Path) -> dict[str, Tally]:
    """Adds up every JUnit file in the folder."""
    tallies = {kind: Tally() for kind in KINDS}
    for path in sorted(folder.glob("*.xml")):
        whole_run = {"python": "python", "target": "target", "fuzz": "fuzz", "ctest-sanitize": "sanitize"}.get(path.stem)
        labels = {} if whole_run else labels_of(path.with_suffix(".json"))
        for case in ElementTree.parse(path).getroot().iter("testcase"):
            tally = tallies[whole_run or labels[case.get("name")]]
            outcome = outcome_of(case)
            tally.outcomes[outcome] += 1
            if outcome == "skipped":
                tally.skip_reasons[skip_reason(case)] += 1
    return tallies


def summary_lines(tallies: dict[str, Tally]) -> list[str]:
    """One line per kind, one per reason to skip, and the total."""
    lines = []
    total: Counter = Counter()
    for kind, tally in tallies.items():
        total += tally.outcomes
        if not tally.outcomes:
            lines.append(f"{kind:<8} not run")
            continue
        counts = ", ".join(f"{n} {outcome}" for outcome, n in sorted(tally.outcomes.items()))
        lines.append(f"{kind:<8} {counts}")
        lines += [f"{'':<8} skipped {n}: {reason}" for reason, n in sorted(tally.skip_reasons.items())]
    lines.append(f"{total['passed']} passed, {total['failed']} failed, {total['skipped']} skipped")
    return lines


def main(arguments: list[str]) -> int:
    """Prints the summary of the folder named on the command line."""
    if len(arguments) != 1:
        print(__doc__, file=sys.stderr)
        return 2
    tallies = read_reports(Path(arguments[0]))
    print("\n".join(summary_lines(tallies)))
    ran = sum(tally.outcomes["passed"] + tally.outcomes["failed"] for tally in tallies.values())
    failed = sum(tally.outcomes["failed"] for tally in tallies.values())
    return 1 if failed or not ran else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
