"""Command line of the report."""

from __future__ import annotations

import argparse
import sys
import webbrowser
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from plumb_tools import files
from plumb_tools.arguments import whole_number
from plumb_tools.report import animation, page
from plumb_tools.report.belonging import expect_same_flight
from plumb_tools.report.flight import read_flight
from plumb_tools.report.model import build
from plumb_tools.report.overlay import choose_rows, views
from plumb_tools.report.run import Run, read_run
from plumb_tools.score.estimate import never_started
from plumb_tools.trajectory import InputError

EXIT_BAD_INPUT = 2
DEFAULT_IMAGES = 60
MAX_IMAGES = 400

DESCRIPTION = """\
Makes one HTML page of a flight: trajectory, errors with their bounds, range profile, scale, images with the features
and facets the filter saw, CPU time, consistency, modes and events. The page is one file and opens without a network.

RUN           output folder of plumb-replay, flown with the range finder
RUN_NO_RANGE  output folder of the same flight flown with --no-range, for comparison"""

EXAMPLES = """\
examples:
  tools/report out/mh01 --flight mh01 --open                    one replay, opened in the browser
  tools/report out/range out/vio --flight mh01 --out mh01.html  range-VIO beside VIO
  tools/report build/demo/demo/range --flight build/flights/demo-1 --animation docs/images/overlay.webp
                                                                the animated image of the README, after tools/demo

exit codes: 0 written, 2 bad input"""


def _animation_file(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in animation.SUFFIXES:
        raise argparse.ArgumentTypeError(f"{text!r}; expected a name that ends in {' or '.join(animation.SUFFIXES)}")
    return path


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="report",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("run", metavar="RUN", type=Path)
    parser.add_argument("run_no_range", metavar="RUN_NO_RANGE", type=Path, nargs="?")
    parser.add_argument(
        "--flight", metavar="DIR", type=Path, required=True, help="the flight in ASL layout: the folder that holds mav0"
    )
    parser.add_argument("--out", metavar="FILE", type=Path, default=Path("report.html"), help="default: %(default)s")
    parser.add_argument(
        "--images",
        metavar="N",
        type=whole_number(1, MAX_IMAGES),
        default=DEFAULT_IMAGES,
        help="images to embed for the viewer (default: %(default)s)",
    )
    parser.add_argument(
        "--animation", metavar="FILE", type=_animation_file, help="also write an animated image (.webp or .gif)"
    )
    parser.add_argument("--open", action="store_true", help="open the page in the browser")
    return parser


def write_report(
    folder: Path, runs: list[Run], absent: dict[str, str], out: Path, images: int, progress: page.Progress
) -> int:
    """Writes the page of a flight and its replays, range-VIO first; returns its size in bytes.

    `absent` names replays that gave no solution, and says why.
    """
    flight = read_flight(folder)
    for run in runs:
        expect_same_flight(flight, run)
    rows = choose_rows(runs[0].states["range_outcome"].astype(int), images)
    text = page.render(build(flight, runs, absent), views(flight, runs[0], rows), progress)
    files.write_text(out, text)
    return out.stat().st_size


def _read_runs(arguments: argparse.Namespace) -> tuple[list[Run], dict[str, str]]:
    """The replays under the names of what they are, and why one of them is not among them."""
    if (reason := never_started(arguments.run)) is not None:
        return _read_second(arguments, reason)
    main = read_run(arguments.run, "range-VIO")
    with_range = bool(main.states["range_outcome"].any())
    if arguments.run_no_range is None:
        return [main if with_range else replace(main, label="VIO")], {}
    if not with_range:
        raise InputError(f"{arguments.run}: flown without a single range; it is compared with a flight without range")
    if (reason := never_started(arguments.run_no_range)) is not None:
        return [main], {"VIO": reason}
    return [main, read_run(arguments.run_no_range, "VIO")], {}


def _read_second(arguments: argparse.Namespace, reason: str) -> tuple[list[Run], dict[str, str]]:
    """The replay for comparison when the first one never started."""
    if arguments.run_no_range is None:
        raise InputError(f"{arguments.run}: {reason}; expected a replay with a state")
    run = read_run(arguments.run_no_range, "VIO")
    if run.states["range_outcome"].any():
        raise InputError(f"{arguments.run_no_range}: flown with ranges; it goes first, the flight without range second")
    return [run], {"range-VIO": reason}


def _write(arguments: argparse.Namespace, console: Console) -> None:
    files.expect_file(arguments.out, "--out")
    if arguments.animation is not None:
        files.expect_file(arguments.animation, "--animation")
    runs, absent = _read_runs(arguments)

    def tell(text: str) -> None:
        console.print(f"report: {text}", style="dim", highlight=False, soft_wrap=True)

    size = write_report(arguments.flight, runs, absent, arguments.out, arguments.images, tell)
    tell(f"{arguments.out} ({size / 1e6:.1f} MB)")
    if arguments.animation is not None:
        tell("drawing the animation")
        size = animation.save(read_flight(arguments.flight), runs[0], arguments.animation)
        tell(f"{arguments.animation} ({size / 1e6:.1f} MB)")


def main(argv: list[str] | None = None) -> int:
    """Writes the report as the arguments tell; returns the exit code."""
    arguments = _parser().parse_args(argv)
    try:
        _write(arguments, Console(stderr=True))
    except (InputError, OSError) as error:
        print(f"report: {files.told(error)}", file=sys.stderr)
        return EXIT_BAD_INPUT
    if arguments.open:
        webbrowser.open(arguments.out.resolve().as_uri())
    return 0


if __name__ == "__main__":
    sys.exit(main())
