"""`tools/golden`: the hashes of short flights, so that no change of the bits of flight goes unseen."""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from plumb_tools import files
from plumb_tools.demo.pipeline import ROOT, replay_summary
from plumb_tools.demo.process import StepFailed, exit_code
from plumb_tools.trajectory import InputError

GOLDEN = ROOT / "test" / "replay" / "golden.json"
BIN = ROOT / "build" / "flight" / "bin"
SCENES = ("outdoor_cruise_stepped", "hover")
SEED = 1
RECORDING = "euroc_mh01"

DESCRIPTION = """\
Flies short flights with what is built in build/flight and compares the hash over all their states with that in
test/replay/golden.json: simulated ones (plumb-montecarlo) and, where it is there, the recorded one. A difference means
that the same inputs no longer give the same bits. Where that is wanted, --accept keeps the new hashes, in a commit that
says why. They hold for gcc on x86-64 with FMA, which the C library's functions make use of; tools/test --arm64 compares
across machines."""


def simulated() -> dict[str, str]:
    """Hash by flight."""
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "flights.csv"
        command = [BIN / "plumb-montecarlo", "--scene", *SCENES, "--seeds", "1", "--first-seed", SEED, "--csv", table]
        subprocess.run([str(word) for word in command], check=True, capture_output=True)
        with table.open(encoding="utf-8", newline="") as rows:
            return {f"{row['scene']}, {row['filter']}": row["state_hash"] for row in csv.DictReader(rows)}


def recorded(recording: Path) -> dict[str, str]:
    """Hash of a recording, flown with range."""
    return {RECORDING: replay_summary(recording)["run_hash"]}


def read_golden(file: Path) -> dict[str, str]:
    """The hashes that are to come."""
    try:
        tree = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: not a file of hashes: {error}") from None
    if not isinstance(tree, dict) or not all(isinstance(value, str) for value in tree.values()):
        raise InputError(f"{file}: expected a hash by the name of each flight")
    return tree


def differences(seen: dict[str, str], golden: dict[str, str]) -> list[str]:
    """A line for each flight whose hash is another."""
    return [
        f"{flight}: {value}, expected {golden.get(flight, 'none')}"
        for flight, value in seen.items()
        if golden.get(flight) != value
    ]


def _golden(arguments: argparse.Namespace) -> None:
    seen = simulated()
    if arguments.recording.is_dir():
        seen |= recorded(arguments.recording)
    else:
        print(f"golden: no {arguments.recording}: only simulated flights", file=sys.stderr)
    told = differences(seen, read_golden(GOLDEN))
    if told and not arguments.accept:
        raise StepFailed("\n  ".join(["other bits than before", *told, "if that is wanted: --accept, and say why"]))
    if told:
        files.write_text(GOLDEN, json.dumps({**read_golden(GOLDEN), **seen}, indent=2) + "\n")
    kept = f"kept {len(told)} other hashes" if told else "all hashes as before"
    print("\n  ".join([f"golden: {len(seen)} flights, {kept}", *told]))


def main(argv: Sequence[str] | None = None) -> int:
    """Flies and compares; returns the exit code."""
    parser = argparse.ArgumentParser(prog="golden", description=DESCRIPTION)
    parser.add_argument("--accept", action="store_true", help="keep the new hashes")
    parser.add_argument(
        "--recording", metavar="DIR", type=Path, default=ROOT.parent / "shared/data" / RECORDING,
        help=f"the recorded flight (default: ../shared/data/{RECORDING})",
    )  # fmt: skip
    arguments = parser.parse_args(argv)
    return exit_code("golden", lambda: _golden(arguments), "nothing was kept")


if __name__ == "__main__":
    sys.exit(main())
