#!/usr/bin/env python3
"""How well the tracker that flies follows features, against the truth of whole flights: a row of a table for each.

    build/venv/bin/python test/budget/track_noise.py build/flights/indoor-1 ../shared/data/euroc_mh01
    build/venv/bin/python test/budget/track_noise.py --params tracker.window=11 --params tracker.levels=3 FLIGHT

Flies each FLIGHT (ASL format, with truth) with plumb-replay, triangulates every track of at least 8 images with the
true poses, and tells what is left: pixels on the plane without distortion at the mean focal length, as
vision.pixel_noise counts them. Tracks that saw their point from too near one place are left out. Errors of the truth,
of its stamps and of the calibration count as noise of the tracker. Correlations are those of the residuals of a track
so many images apart. Residuals of 0.5 px and more are in no rms and no correlation. How long a track lasts is told of
all tracks, short ones too.

Exit codes: 0 done, 1 a flight that plumb-replay does not fly, 2 bad input, 130 interrupted.
"""

import argparse
import sys
import tempfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
from plumb_tools.demo.process import exit_code
from plumb_tools.report.flight import Flight, read_flight
from plumb_tools.report.run import FEATURES_FILE
from plumb_tools.report.tables import Table, read_table
from plumb_tools.score.pairs import poses_at, seconds
from plumb_tools.trajectory import ASL_TRUTH, FloatArray, InputError, IntArray
from tracker_comparison import replay

ROOT = Path(__file__).parents[2]
MIN_IMAGES = 8
MIN_BASELINE = 0.05  # from the first image of a track on, over the mean depth of its point
MIN_DEPTH_M = 0.1
CAUCHY_PX = 1.0
STEPS = 10
FOLLOWED_PX = 0.5  # what is further off is not noise
LOST_PX = 1.0
LAGS = (1, 4, 10)  # images
HEADS = ["tracks", "observations", "images a track lasts", "median [px]", "rms per axis [px]"]
HEADS += [f"beyond {limit:g} px [%]" for limit in (FOLLOWED_PX, LOST_PX)]
HEADS += [f"correlation at {lag}" for lag in LAGS]


@dataclass(frozen=True)
class Seen:
    """Observations, those of a track one after the other in the order of images; tracks are counted from 0."""

    track: IntArray  # (N,)
    image: IntArray  # (N,) rows of Cameras
    plane: FloatArray  # (N, 2) normalised, without distortion

    def select(self, keep: npt.NDArray[np.bool_]) -> "Seen":
        """Those where `keep` is true, their tracks counted anew."""
        return Seen(np.unique(self.track[keep], return_inverse=True)[1], self.image[keep], self.plane[keep])


@dataclass(frozen=True)
class Cameras:
    """True poses of the camera at the stamps of images, and its mean focal length."""

    R_CW: FloatArray  # (M, 3, 3)
    p_WC_m: FloatArray  # (M, 3)
    focal_px: float


@dataclass(frozen=True)
class Noise:
    """What the residuals of a flight come to."""

    tracks: int
    observations: int
    images_a_track: float
    median_px: float
    rms_px: float
    beyond_followed: float
    beyond_lost: float
    correlations: tuple[float, ...]

    def text(self) -> str:
        """The cells of the table."""
        counts = f"{self.tracks} | {self.observations} | {self.images_a_track:.1f}"
        sizes = f"{self.median_px:.3f} | {self.rms_px:.3f}"
        shares = f"{100.0 * self.beyond_followed:.2f} | {100.0 * self.beyond_lost:.2f}"
        return " | ".join([counts, sizes, shares, *(f"{value:.2f}" for value in self.correlations)])


def yaml_of(settings: list[str]) -> str:
    """NAME=VALUE each, as a file of parameters."""
    lines = []
    for setting in settings:
        name, equals, value = setting.partition("=")
        if not (name and equals and value and "." in name):
            raise InputError(f"--params {setting}: expected NAME=VALUE, for example tracker.window=11")
        lines.append(f"{name}: {value}\n")
    return "".join(lines)


def features_of(program: Path, flight: Path, parameters: str) -> Table:
    """The features of a flight, as plumb-replay sees them."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        replay(program, flight, out, parameters)
        return read_table(out / FEATURES_FILE, ("track_id", "u_px", "v_px"))


def measurable(flight: Flight, features: Table) -> tuple[Seen, Cameras]:
    """All that was seen while there is a truth, and from where."""
    if flight.truth is None:
        raise InputError(f"{flight.folder}: expected a flight with truth; {ASL_TRUTH} is missing")
    truth = flight.truth.trajectory
    rows = np.lexsort((features.t_ns, features["track_id"]))
    rows = rows[(features.t_ns[rows] >= truth.t_ns[0]) & (features.t_ns[rows] <= truth.t_ns[-1])]
    if not rows.size:
        raise InputError(f"{flight.folder}: its truth is of another time than its images")
    t_ns, image = np.unique(features.t_ns[rows], return_inverse=True)
    track = np.unique(features["track_id"][rows], return_inverse=True)[1]
    seen = Seen(track, image, flight.camera.undistort(features.stack(("u_px", "v_px"))[rows]))
    p_WI_m, q_WI = poses_at(truth, seconds(t_ns, int(truth.t_ns[0])), int(truth.t_ns[0]))
    R_CW = (q_WI * flight.q_IC).inv().as_matrix()
    return seen, Cameras(R_CW, p_WI_m + q_WI.apply(flight.p_IC_m), float(np.mean(flight.camera.intrinsics[:2])))


def solve(rows: FloatArray, right: FloatArray, weights: FloatArray, starts: IntArray) -> FloatArray:
    """Least squares of three unknowns for each track: rows (N, 2, 3) and right sides (N, 2) of its observations."""
    weighted = weights[:, None, None] * rows
    matrix = np.add.reduceat(np.einsum("nij,nik->njk", weighted, rows), starts)
    vector = np.add.reduceat(np.einsum("nij,ni->nj", weighted, right), starts)
    return np.asarray(np.linalg.solve(matrix + 1e-9 * np.eye(3), vector[:, :, None])[:, :, 0])


def residuals_px(seen: Seen, cameras: Cameras) -> FloatArray:
    """(N, 2) from the point that fits a track best; not a number where that cannot be told."""
    starts = np.flatnonzero(np.diff(seen.track, prepend=-1))
    turn = cameras.R_CW[seen.image]
    place = cameras.p_WC_m[seen.image]
    place = place - place[starts][seen.track]  # from where the track begins
    rows = turn[:, :2] - seen.plane[:, :, None] * turn[:, 2:]
    points = solve(rows, np.einsum("nij,nj->ni", rows, place), np.ones(len(rows)), starts)
    nearest_m = np.full(len(starts), np.inf)
    for step in range(STEPS + 1):
        in_C = np.einsum("nij,nj->ni", turn, points[seen.track] - place)
        nearest_m = np.minimum(nearest_m, np.minimum.reduceat(in_C[:, 2], starts))
        depth = np.maximum(in_C[:, 2], MIN_DEPTH_M)[:, None]
        expected = in_C[:, :2] / depth
        off = seen.plane - expected
        if step < STEPS:
            rows = (turn[:, :2] - expected[:, :, None] * turn[:, 2:]) / depth[:, :, None]
            weights = 1.0 / (1.0 + (cameras.focal_px / CAUCHY_PX * np.linalg.norm(off, axis=1)) ** 2)
            points = points + solve(rows, off, weights, starts)
    baseline_m = np.maximum.reduceat(np.linalg.norm(place, axis=1), starts)
    mean_depth_m = np.add.reduceat(in_C[:, 2], starts) / np.bincount(seen.track)
    told = (nearest_m >= MIN_DEPTH_M) & (baseline_m >= MIN_BASELINE * mean_depth_m)
    return np.where(told[seen.track][:, None], cameras.focal_px * off, np.nan)


def correlation(seen: Seen, residuals: FloatArray, lag: int) -> float:
    """Of residuals (N, 2) of a track so many images apart, both of features that were followed."""
    followed = np.linalg.norm(residuals, axis=1) < FOLLOWED_PX
    pairs = (seen.track[lag:] == seen.track[:-lag]) & (seen.image[lag:] - seen.image[:-lag] == lag)
    pairs &= followed[lag:] & followed[:-lag]
    early, late = residuals[:-lag][pairs], residuals[lag:][pairs]
    return float(np.sum(early * late) / np.sum(early**2)) if len(early) else np.nan


def noise_of(seen: Seen, cameras: Cameras) -> Noise:
    """The figures of all tracks that are long enough."""
    lengths = np.bincount(seen.track)
    long = seen.select(lengths[seen.track] >= MIN_IMAGES)
    residuals = residuals_px(long, cameras) if len(long.track) else np.zeros((0, 2))
    told = np.isfinite(residuals[:, 0])
    long, residuals = long.select(told), residuals[told]
    size_px = np.linalg.norm(residuals, axis=1)
    followed = size_px[size_px < FOLLOWED_PX]
    if not followed.size:
        raise InputError(f"no track can be measured: expected some of {MIN_IMAGES} images or more, taken from apart")
    return Noise(
        len(np.unique(long.track)),
        len(residuals),
        float(lengths.mean()),
        float(np.median(size_px)),
        float(np.sqrt(np.mean(followed**2) / 2.0)),
        float(np.mean(size_px > FOLLOWED_PX)),
        float(np.mean(size_px > LOST_PX)),
        tuple(correlation(long, residuals, lag) for lag in LAGS),
    )


def measure(flights: list[Path], program: Path, settings: list[str]) -> None:
    """Flies and prints the table, each row as soon as it is known."""
    parameters = yaml_of(settings)
    if absent := [folder for folder in flights if not folder.is_dir()]:
        raise InputError(f"{absent[0]}: no such folder; expected the folder that holds mav0")
    read = [read_flight(folder) for folder in flights]
    print(f"| flight | {' | '.join(HEADS)} |\n|---|{'---:|' * len(HEADS)}", flush=True)
    for flight in read:
        seen, cameras = measurable(flight, features_of(program, flight.folder, parameters))
        try:
            print(f"| {flight.name} | {noise_of(seen, cameras).text()} |", flush=True)
        except InputError as error:
            raise InputError(f"{flight.folder}: {error}") from None


def main(argv: list[str] | None = None) -> int:
    """Measures as the arguments tell; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flights", type=Path, nargs="+", metavar="FLIGHT")
    what = "a parameter of plumb-replay, as often as wanted"
    parser.add_argument("--params", action="append", default=[], metavar="NAME=VALUE", help=what)
    parser.add_argument("--build", type=Path, default=ROOT / "build/flight", help="default: %(default)s")
    arguments = parser.parse_args(argv)
    work = partial(measure, arguments.flights, arguments.build / "bin/plumb-replay", arguments.params)
    return exit_code("track_noise", work, "the rows printed are whole")


if __name__ == "__main__":
    sys.exit(main())
