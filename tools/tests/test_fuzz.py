"""What tools/fuzz reads from the output of libFuzzer."""

from __future__ import annotations

from plumb_tools.fuzz import Outcome, outcome_of

QUIET = """\
#2\tINITED cov: 11 ft: 12 corp: 1/1b exec/s: 0 rss: 30Mb
#1048576\tpulse  cov: 262 ft: 819 corp: 196/8046b lim: 4096 exec/s: 262144 rss: 60Mb
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
