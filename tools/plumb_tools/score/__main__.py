"""Command line of the scorer."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from rich.console import Console

from plumb_tools import files
from plumb_tools.arguments import positive_seconds, seconds
from plumb_tools.report import belonging
from plumb_tools.report.flight import CAMERA_FILE, read_flight
from plumb_tools.report.run import read_run
from plumb_tools.score import table
from plumb_tools.score.compute import DEFAULT_MAX_TIME_DIFF_S, Options, Score, Scored, score
from plumb_tools.score.estimate import SUMMARY_FILE, read_estimate
from plumb_tools.trajectory import InputError, read_truth

EXIT_BAD_INPUT = 2
SUITE_OPTION = "--suite"
STANDARD_OUTPUT = "-"

PLOT_SUFFIXES = (".png", ".pdf", ".svg")

DESCRIPTION = """\
Scores an estimated trajectory against the truth.

TRUTH  an ASL folder (mav0/state_groundtruth_estimate0/data.csv), such a csv, or a TUM file
EST    a TUM file (t tx ty tz qx qy qz qw), or the output folder of plumb-replay or the trajectory.tum in it,
       which add velocity error and the consistency of the covariance (NEES)

Poses are those of the IMU in a world with z up. The truth is interpolated to the stamps of the estimate.
Headline: absolute trajectory error (ATE) after alignment in position and yaw, the four degrees of freedom
that visual-inertial odometry cannot observe."""

EXAMPLES = """\
examples:
  tools/score mh01 out/mh01                             score a replay of an ASL folder
  tools/score truth.tum est.tum --plot error.png        two TUM files, with a picture
  tools/score mh01 est.tum --start 5 --end 20           from 5 to 20 s after the first image
  tools/score mh01 est.tum --align sim3 --plot e.png    picture without scale error
  tools/score mh01 out/mh01 --json score.json           figures for machines; '-' for standard output
  tools/score --suite --help                            every simulated scene and seed, into docs/results.md

exit codes: 0 scored, 2 bad input"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="score",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("truth", metavar="TRUTH", type=Path)
    parser.add_argument("estimate", metavar="EST", type=Path)
    parser.add_argument(
        "--json", metavar="FILE", help="write all figures to a JSON file; '-' prints them instead of the table"
    )
    parser.add_argument("--plot", metavar="FILE", type=Path, help="draw the errors and the path (png, pdf, svg)")
    parser.add_argument(
        "--max-time-diff",
        metavar="S",
        type=positive_seconds,
        default=DEFAULT_MAX_TIME_DIFF_S,
        help="a pose counts when the truth has one within this time (default: %(default)s s)",
    )
    parser.add_argument(
        "--align",
        choices=("4dof", "se3", "sim3", "none"),
        default="4dof",
        help="alignment to point out and to plot; the table has all of them (default: %(default)s)",
    )
    parser.add_argument(
        "--start", metavar="S", type=seconds, help="leave out what is before, seconds after the span's start"
    )
    parser.add_argument(
        "--end", metavar="S", type=seconds, help="leave out what is after, seconds after the span's start"
    )
    return parser


def _write_json(figures: Score, target: str) -> None:
    text = json.dumps(figures.as_json(), indent=2, allow_nan=False) + "\n"
    if target == STANDARD_OUTPUT:
        sys.stdout.write(text)
    else:
        files.write_text(Path(target), text)


def _score(arguments: argparse.Namespace) -> Scored:
    if arguments.json not in (None, STANDARD_OUTPUT):
        files.expect_file(Path(arguments.json), "--json")
    if arguments.plot is not None:
        files.expect_file(arguments.plot, "--plot")
    start, end = arguments.start, arguments.end
    if start is not None and end is not None and end <= start:
        raise InputError(f"--end {end:g} is not after --start {start:g}")
    options = Options(arguments.max_time_diff, arguments.align, start, end)
    _expect_same_flight(arguments.truth, arguments.estimate)
    return score(read_truth(arguments.truth), read_estimate(arguments.estimate), options)


def _expect_same_flight(truth: Path, estimate: Path) -> None:
    """Refuses a replay of another flight: the clocks of simulated flights all begin alike."""
    folder = estimate if estimate.is_dir() else estimate.parent
    if not ((folder / SUMMARY_FILE).is_file() and (truth / CAMERA_FILE).is_file()):
        return
    belonging.expect_same_flight(read_flight(truth), read_run(folder, folder.name))


def _deliver(scored: Scored, arguments: argparse.Namespace) -> None:
    if arguments.json is not None:
        _write_json(scored.score, arguments.json)
    if arguments.json != STANDARD_OUTPUT:
        console = Console()
        table.show(scored.score, console if console.is_terminal else Console(width=table.WIDTH))
    if arguments.plot is not None:
        from plumb_tools.score import plot  # costs a second to load: only when a picture is wanted

        with files.whole(arguments.plot) as unfinished:
            plot.save(scored, unfinished)


def main(argv: list[str] | None = None) -> int:
    """Scores as the arguments tell; returns the exit code."""
    words = sys.argv[1:] if argv is None else argv
    if SUITE_OPTION in words:
        from plumb_tools.score import suite  # it knows of simulator, replay and report; scoring alone does not

        return suite.main(words)
    parser = _parser()
    arguments = parser.parse_args(argv)
    if arguments.plot is not None and arguments.plot.suffix.lower() not in PLOT_SUFFIXES:
        parser.error(f"--plot: {arguments.plot}: the name must end in one of {', '.join(PLOT_SUFFIXES)}")
    try:
        scored = _score(arguments)
        _deliver(scored, arguments)
    except (InputError, OSError) as error:
        print(f"score: {files.told(error)}", file=sys.stderr)
        return EXIT_BAD_INPUT
    return 0


if __name__ == "__main__":
    sys.exit(main())
