"""Images with what the filter saw in them: features, tracks, the facets between features and the one under the beam.

All positions are pixels of the image as taken, column and row.
"""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError
from scipy.spatial import Delaunay, QhullError

from plumb_tools.report.camera import Camera
from plumb_tools.report.flight import Flight
from plumb_tools.report.run import FACET, RangeOutcome, Run
from plumb_tools.report.tables import Table, read_table
from plumb_tools.trajectory import FloatArray, InputError, IntArray

#: Images of a track's past that its tail shows.
TAIL_IMAGES = 8
JPEG_QUALITY = 68

_FEATURE_COLUMNS = ("track_id", "u_px", "v_px", "slam")

#: Of the images near a wanted time the one that shows most is taken: a gated range first, then a used one.
_WORTH = {RangeOutcome.GATED: 2, RangeOutcome.USED: 1, RangeOutcome.FEATURE: 1}


@dataclass(frozen=True)
class View:
    """What the filter saw in one image."""

    row: int  #: of states.csv
    t_s: float  #: since the first image
    file: Path
    slam_px: FloatArray  #: (N, 2) features in the state
    tracks_px: FloatArray  #: (N, 2) other tracks
    tails_px: list[FloatArray]  #: past positions of the other tracks, (n, 2) each, newest last
    facets_px: FloatArray  #: (N, 3, 2) Delaunay triangles between the features in the state
    ranged_px: FloatArray | None  #: (3, 2) the facet that the range was compared with
    beam_px: FloatArray | None  #: (2,) where the beam met the surface


def choose_rows(outcomes: IntArray, limit: int) -> IntArray:
    """Rows of states.csv to show: at most `limit`, one from each of as many equal parts of the flight."""
    edges = np.linspace(0, len(outcomes), min(limit, len(outcomes)) + 1).round().astype(int)
    chosen = []
    for start, end in zip(edges[:-1], edges[1:], strict=True):
        middle = 0.5 * (start + end - 1)
        chosen.append(
            max(range(start, end), key=lambda i: (_WORTH.get(RangeOutcome(int(outcomes[i])), 0), -abs(i - middle)))
        )
    return np.array(chosen, dtype=np.int64)


def delaunay_facets(pixels: FloatArray, camera: Camera) -> FloatArray:
    """Triangles (N, 3, 2) between points (M, 2), triangulated as the filter does: without the lens distortion."""
    if len(pixels) < 3:
        return np.zeros((0, 3, 2))
    try:
        triangles = Delaunay(camera.undistort(pixels)).simplices
    except QhullError:  # all points on a line
        return np.zeros((0, 3, 2))
    return np.asarray(pixels[triangles])


class FeatureLog:
    """The features of every image, from features.csv."""

    def __init__(self, path: Path) -> None:
        """Reads the file."""
        self._table: Table = read_table(path, _FEATURE_COLUMNS)
        self._stamps, self._starts = np.unique(self._table.t_ns, return_index=True)
        self._ends = np.append(self._starts[1:], len(self._table))

    def at(self, t_ns: int) -> FloatArray:
        """Features of the image at a stamp: (N, 4) of track id, column, row, and 1 when in the state."""
        place = int(np.searchsorted(self._stamps, t_ns))
        if place == len(self._stamps) or self._stamps[place] != t_ns:
            return np.zeros((0, 4))
        rows = slice(self._starts[place], self._ends[place])
        return np.column_stack([self._table[name][rows] for name in _FEATURE_COLUMNS])


def views(flight: Flight, run: Run, rows: IntArray) -> list[View]:
    """What the filter saw in the images of the given rows of states.csv."""
    log = None if run.features_file is None else FeatureLog(run.features_file)
    place_of = {int(t): index for index, t in enumerate(flight.t_images_ns)}
    found = []
    for row in rows.tolist():
        place = place_of[int(run.states.t_ns[row])]
        found.append(_view(flight, run, row, flight.image_files[place], log))
    return found


def _view(flight: Flight, run: Run, row: int, file: Path, log: FeatureLog | None) -> View:
    states = run.states
    seen = np.zeros((0, 4)) if log is None else log.at(int(states.t_ns[row]))
    in_state = seen[:, 3] > 0.0
    slam, others = seen[in_state], seen[~in_state]
    return View(
        row,
        float(flight.seconds(states.t_ns[row : row + 1])[0]),
        file,
        slam[:, 1:3],
        others[:, 1:3],
        [] if log is None else _tails(states, row, others[:, 0], log),
        delaunay_facets(slam[:, 1:3], flight.camera),
        _ranged_facet(states, row, seen),
        _beam(flight, states, row),
    )


def _tails(states: Table, row: int, ids: FloatArray, log: FeatureLog) -> list[FloatArray]:
    past: dict[int, list[FloatArray]] = {int(track): [] for track in ids}
    for earlier in range(max(0, row - TAIL_IMAGES), row + 1):
        for track, u, v, _ in log.at(int(states.t_ns[earlier])):
            if int(track) in past:
                past[int(track)].append(np.array([u, v]))
    return [np.array(points) for points in past.values() if len(points) > 1]


def _ranged_facet(states: Table, row: int, seen: FloatArray) -> FloatArray | None:
    """Vertices of the facet under the beam; None when there was none or a vertex is not in this image."""
    if any(name not in states for name in FACET):
        return None
    ids = [int(states[name][row]) for name in FACET]
    place = {int(track): index for index, track in enumerate(seen[:, 0])}
    if not any(ids) or any(track not in place for track in ids):
        return None
    return seen[[place[track] for track in ids], 1:3]


def _beam(flight: Flight, states: Table, row: int) -> FloatArray | None:
    range_m = float(states["range_measured_m"][row])
    finder = flight.range_finder
    if finder is None or not range_m > 0.0 or int(states["range_outcome"][row]) == RangeOutcome.NONE:
        return None
    point = flight.camera.project((finder.origin_C_m + range_m * finder.beam_C)[None, :])[0]
    inside = 0.0 <= point[0] < flight.camera.width and 0.0 <= point[1] < flight.camera.height
    return point if inside else None


def read_image(file: Path, width: int) -> Image.Image:
    """A camera image in grey, reduced to a width in pixels (never enlarged)."""
    try:
        with Image.open(file) as image:
            grey = image.convert("L")
    except FileNotFoundError:
        raise InputError(f"{file}: no such image (were the images deleted after flying?)") from None
    except (OSError, UnidentifiedImageError) as error:
        raise InputError(f"{file}: cannot be read as an image: {error}") from None
    if grey.width <= width:
        return grey
    return grey.resize((width, round(grey.height * width / grey.width)), Image.Resampling.LANCZOS)


def jpeg_uri(file: Path, width: int) -> str:
    """A camera image as a data URI."""
    buffer = io.BytesIO()
    read_image(file, width).save(buffer, "JPEG", quality=JPEG_QUALITY, optimize=True)
    return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
