#!/usr/bin/env python3
"""Whether every C++ file is laid out as .clang-format says.

    test/checks/format_check.py [--fix] [FILE...]

Without files, all of the repository's. --fix lays them out. Exits with 1 when a file is not as it should be. Uses the
clang-format of this Python environment, whose version is pinned in pyproject.toml: another one would disagree.
"""

import argparse
import subprocess
import sys
from pathlib import Path

from sources import ROOT, cpp_files


def clang_format() -> Path:
    """The pinned clang-format, from the environment that tools/setup makes."""
    for folder in (Path(sys.prefix) / "bin", ROOT / "build" / "venv" / "bin"):
        if (program := folder / "clang-format").exists():
            return program
    sys.exit("format: no clang-format in build/venv; run tools/setup")


def main(arguments: list[str]) -> int:
    """Checks or lays out the files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fix", action="store_true", help="lay the files out instead of complaining")
    parser.add_argument("files", nargs="*", type=Path, help="default: all C++ files of the repository")
    options = parser.parse_args(arguments)
    files = options.files or [ROOT / path for path in cpp_files(ROOT)]
    if options.fix:
        return subprocess.run([clang_format(), "-i", *files], check=False).returncode
    # One process for all: starting it takes longer than reading a file.
    check = subprocess.run([clang_format(), "--dry-run", "--Werror", *files], check=False, capture_output=True, text=True)
    wrong = sorted({Path(line.split(":")[0]) for line in check.stderr.splitlines() if "clang-format-violations" in line})
    if check.returncode != 0 and not wrong:
        sys.exit(f"format: clang-format failed: {check.stderr}")
    for file in wrong:
        shown = file.relative_to(ROOT) if file.is_relative_to(ROOT) else file
        print(f"{shown}: not laid out as .clang-format says")
    if wrong:
        print("To lay out all files: build/venv/bin/python test/checks/format_check.py --fix")
        return 1
    print(f"format: {len(files)} files, all as .clang-format says")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
