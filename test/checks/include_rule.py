#!/usr/bin/env python3
"""Which folder may include what, and what flight code may not say. The rule is in docs/architecture.md.

    test/checks/include_rule.py [ROOT]

Prints one line per breach (file:line: what and why) and exits with 1 when there is one.
"""

import re
import sys
from dataclasses import dataclass
from pathlib import Path

from sources import ROOT, cpp_files, without_comments_and_text

# Standard headers that need no heap, no operating system, no clock and no stream. Flight code and drivers include no
# other standard or system header: a list of what is allowed can not be outrun by a new header.
FREESTANDING = frozenset(
    "algorithm array atomic bit cfloat climits cmath compare complex concepts cstddef cstdint cstring initializer_list "
    "iterator limits numbers numeric optional ratio span string_view tuple type_traits utility".split()
)


@dataclass(frozen=True)
class Rule:
    """What the files below one folder may include, besides files of their own folder."""

    project: tuple[str, ...]  # folders or single headers of this repository
    libraries: tuple[str, ...] = ()  # beginnings of <> includes, besides FREESTANDING
    any_system_header: bool = False  # for code that talks to the operating system
    flight: bool = True  # no exceptions, no heap, at most MAX_LINES


EIGEN = ("Eigen/",)
MATH = ("fsw/base", "fsw/math")

# The longest matching folder decides. A file below fsw, drivers or hal with no rule is a breach.
RULES = {
    "fsw/base": Rule(()),
    "fsw/math": Rule(("fsw/base",), EIGEN),
    "fsw/measurement": Rule(("fsw/base",)),
    # OpenCV's universal intrinsics are header-only SIMD without heap; those of AVX2 need the compiler's own.
    "fsw/vision": Rule((*MATH, "fsw/measurement"), (*EIGEN, "opencv2/core/hal/intrin.hpp", "immintrin.h")),
    # The estimator sees features, never images: of vision only the track table, the feature frame and the interface.
    "fsw/estimator": Rule(
        (
            *MATH,
            "fsw/measurement",
            "fsw/vision/feature_frame.h",
            "fsw/vision/track_table.h",
            "fsw/vision/tracker.h",
        ),
        EIGEN,
    ),
    "fsw/predictor": Rule((*MATH, "fsw/measurement"), EIGEN),
    "fsw/modes": Rule(("fsw/base", "fsw/measurement")),
    "fsw/events": Rule(("fsw/base",)),
    "fsw/params": Rule(("fsw/base",)),
    # Encoders of what the others report, into message types generated from *.lcm.
    "fsw/telemetry": Rule(
        (
            *MATH,
            "fsw/measurement",
            "fsw/vision",
            "fsw/estimator",
            "fsw/predictor",
            "fsw/modes",
            "fsw/events",
            "fsw/params",
            "fsw/schedule",
        ),
        EIGEN,
    ),
    "fsw/schedule": Rule(("fsw/base",)),
    # The composition root: the one place in flight code that knows every part and the ports they are wired to.
    "fsw/app": Rule(("fsw", "hal/include"), EIGEN),
    "drivers": Rule(("fsw/base", "fsw/measurement", "hal/include")),
    "hal/include": Rule(("fsw/base", "fsw/measurement")),
    # What is below the ports: the operating system, or a log.
    "hal": Rule(("fsw/base", "fsw/measurement", "fsw/telemetry", "hal"), any_system_header=True, flight=False),
    # Read before the flight begins: files, and what is wrong with them.
    "config": Rule(("fsw", "drivers", "hal", "config"), any_system_header=True, flight=False),
    # The process around the flight software: threads, devices, files, signals.
    "process": Rule(("fsw", "drivers", "hal", "config", "process"), any_system_header=True, flight=False),
    "test": Rule(("fsw", "drivers", "hal", "config", "process", "tools", "test"), any_system_header=True, flight=False),
    "tools": Rule(("fsw", "drivers", "hal", "config", "tools"), any_system_header=True, flight=False),
}

# The types that lcm-gen makes have no folder in the source tree.
GENERATED = {"plumb_lcm/": ("fsw/telemetry", "fsw/app", "hal", "process", "test", "tools")}

BANNED_WORDS = {
    "throw": "flight code is built without exceptions; return a Status",
    "try": "flight code is built without exceptions; return a Status",
    "catch": "flight code is built without exceptions; return a Status",
    "new": "no heap in flight; use a FixedVector or a member",
    "delete": "no heap in flight; use a FixedVector or a member",
    "malloc": "no heap in flight; use a FixedVector or a member",
    "dynamic_cast": "flight code is built without RTTI",
    "typeid": "flight code is built without RTTI",
}
_BANNED = re.compile(r"\b(" + "|".join(BANNED_WORDS) + r")\b")
_DELETED_FUNCTION = re.compile(r"=\s*delete\b")

MAX_LINES = 400
SIZED_FOLDERS = ("fsw/", "drivers/", "hal/")

_INCLUDE = re.compile(r'^\s*#\s*include\s*(?:"(?P<project>[^"]+)"|<(?P<system>[^>]+)>)')


def is_below(path: str, folder: str) -> bool:
    """Whether the path is the folder or header itself, or lies below it."""
    return path == folder or path.startswith(folder + "/")


def folder_of(path: str) -> str | None:
    """The folder whose rule governs the file: the longest that matches."""
    return max((folder for folder in RULES if is_below(path, folder)), key=len, default=None)


def include_breach(including: str, folder: str, line: str) -> str | None:
    """Why this line may not stand in that file, or nothing."""
    match = _INCLUDE.match(line)
    if match is None:
        return None
    rule = RULES[folder]
    if (header := match.group("system")) is not None:
        if rule.any_system_header or header in FREESTANDING or header.startswith(rule.libraries):
            return None
        return f"<{header}> is not a header without heap, operating system, clock or stream, as {folder} needs"
    header = match.group("project")
    for prefix, users in GENERATED.items():
        if header.startswith(prefix):
            return None if folder in users else f'"{header}" is generated for {", ".join(users)}, not for {folder}'
    if ".." in header.split("/") or folder_of(header) is None:
        return f'"{header}" is not named from the root of the repository'
    own = folder_of(header) == folder
    if own or any(is_below(header, allowed) for allowed in rule.project):
        return None
    return f"{folder} may not include {header}: allowed are {', '.join(rule.project) or 'only its own files'}"


def breaches_of(path: str, source: str) -> list[str]:
    """Every breach of one file, as file:line: text."""
    found = []
    folder = folder_of(path)
    if folder is None:
        return [f"{path}:1: there is no rule for this folder; add it to RULES in test/checks/include_rule.py"]
    for number, line in enumerate(source.splitlines(), start=1):
        if (breach := include_breach(path, folder, line)) is not None:
            found.append(f"{path}:{number}: {breach}")
    if RULES[folder].flight:
        for number, line in enumerate(without_comments_and_text(source).splitlines(), start=1):
            for match in _BANNED.finditer(_DELETED_FUNCTION.sub("", line)):
                found.append(f"{path}:{number}: '{match.group(1)}': {BANNED_WORDS[match.group(1)]}")
    lines = source.count("\n")
    if path.startswith(SIZED_FOLDERS) and lines > MAX_LINES:
        found.append(f"{path}:{lines}: {lines} lines; a file has at most {MAX_LINES}")
    return found


def check(root: Path) -> list[str]:
    """Every breach below root."""
    found = []
    for path in cpp_files(root):
        found += breaches_of(path.as_posix(), (root / path).read_text(encoding="utf-8"))
    return found


def main(arguments: list[str]) -> int:
    """Checks the tree named on the command line, or this one."""
    root = Path(arguments[0]) if arguments else ROOT
    found = check(root)
    print("\n".join(found) if found else f"include rule: {len(cpp_files(root))} files, no breach")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
