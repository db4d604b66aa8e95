"""Command line of the interface control document."""

from __future__ import annotations

import argparse
import difflib
import sys

from plumb_tools import files
from plumb_tools.interface import document
from plumb_tools.trajectory import InputError, read_text

EXIT_OLD = 1
EXIT_BAD_INPUT = 2

DESCRIPTION = """\
Writes docs/interface.md, the interface control document: messages with sizes and fingerprints from fsw/telemetry,
events from fsw/events, schedule and parameters from plumb-fsw and plumb-replay, which have to be built."""


def main(argv: list[str] | None = None) -> int:
    """Writes or checks the document; returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="interface",
        description=DESCRIPTION,
        epilog="exit codes: 0 written, or as it should be, 1 older than its sources, 2 sources that cannot be read",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--check", action="store_true", help="write nothing; show how it differs from its sources")
    arguments = parser.parse_args(argv)
    try:
        wanted = document.text()
        if not arguments.check:
            files.write_text(document.DOCUMENT, wanted)
            return 0
        found = read_text(document.DOCUMENT)
    except InputError as error:
        print(f"interface: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    if found == wanted:
        return 0
    pages = found.splitlines(), wanted.splitlines()
    print("\n".join(difflib.unified_diff(*pages, str(document.DOCUMENT), "its sources", lineterm="")))
    print("interface: docs/interface.md is older than its sources: run tools/interface", file=sys.stderr)
    return EXIT_OLD


if __name__ == "__main__":
    sys.exit(main())
