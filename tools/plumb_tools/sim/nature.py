"""Relief, rocks and trees."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy.ndimage import map_coordinates

from plumb_tools.sim import mesh, noise, objects
from plumb_tools.sim.mesh import Mesh
from plumb_tools.sim.scene import Ground
from plumb_tools.sim.streams import Generator
from plumb_tools.trajectory import FloatArray

#: Height of the ground [m] at points (N, 2).
HeightAt = Callable[[FloatArray], FloatArray]

_LEVEL_RADIUS_M = 2.5  #: the ground is level this far around the place of take-off ...
_LEVEL_BLEND_M = 5.0  #: ... and becomes itself over this distance
_SCARP_WIDTH_M = 0.5

#: Flat ground goes on this far beyond what is painted, which is mirrored there.
_APRON_M = 150.0

_SHORE_POINTS = 72

#: Rocks below this radius get a coarser shape.
_SMALL_ROCK_M = 0.25


@dataclass(frozen=True)
class Terrain:
    """A height field: `height_m[i, j]` at x = x0 + j spacing, y = y0 + i spacing."""

    x0_m: float
    y0_m: float
    spacing_m: float
    height_m: FloatArray

    def at(self, points: FloatArray) -> FloatArray:
        """Heights at points (N, 2), bilinear, held at the edges."""
        rows = (points[:, 1] - self.y0_m) / self.spacing_m
        columns = (points[:, 0] - self.x0_m) / self.spacing_m
        return np.asarray(map_coordinates(self.height_m, [rows, columns], order=1, mode="nearest"))

    def mesh(self) -> Mesh:
        """The surface as triangles."""
        rows, columns = self.height_m.shape
        y, x = np.mgrid[0:rows, 0:columns]
        points = np.column_stack(
            [self.x0_m + x.ravel() * self.spacing_m, self.y0_m + y.ravel() * self.spacing_m, self.height_m.ravel()]
        )
        corner = (y[:-1, :-1] * columns + x[:-1, :-1]).ravel()
        right, above = corner + 1, corner + columns
        triangles = np.concatenate(
            [np.column_stack([corner, right, above + 1]), np.column_stack([corner, above + 1, above])]
        )
        return mesh.indexed(points, triangles, None, None)


def terrain(ground: Ground, level_at: tuple[float, float], random: Generator) -> Terrain:
    """Fractal relief, zero and level where the vehicle starts."""
    x0, y0, x1, y1 = ground.extent_m
    if ground.relief_m == 0.0 and ground.scarp_m == 0.0:
        side = max(x1 - x0, y1 - y0) + 2.0 * _APRON_M
        return Terrain(x0 - _APRON_M, y0 - _APRON_M, side, np.zeros((2, 2)))
    spacing = ground.grid_m
    columns, rows = int(np.ceil((x1 - x0) / spacing)) + 1, int(np.ceil((y1 - y0) / spacing)) + 1
    cells = max(rows, columns)
    lowest = cells * spacing / ground.wavelength_m
    relief = noise.fractal(random, (cells, cells), 1.0 - np.log2(ground.roughness), low=lowest).astype(np.float64)
    height = (ground.relief_m / np.abs(relief).max() * relief)[:rows, :columns]
    cliffs = noise.fractal(random, (cells, cells), 2.2, low=lowest * 0.6, high=lowest * 8.0).astype(np.float64)
    sharpness = ground.wavelength_m / (4.0 * _SCARP_WIDTH_M)
    height += 0.5 * ground.scarp_m * np.tanh(sharpness * cliffs[:rows, :columns])
    raw = Terrain(x0, y0, spacing, height)
    y, x = np.mgrid[0:rows, 0:columns]
    distance = np.hypot(x0 + x * spacing - level_at[0], y0 + y * spacing - level_at[1])
    share = np.clip((distance - _LEVEL_RADIUS_M) / _LEVEL_BLEND_M, 0.0, 1.0)
    share = share * share * (3.0 - 2.0 * share)
    return Terrain(x0, y0, spacing, share * (height - raw.at(np.array([level_at]))[0]))


@cache
def _sphere(levels: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """An octahedron subdivided `levels` times onto the unit sphere: points and triangles."""
    points = [np.array(p, float) for p in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))]
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    for _ in range(levels):
        middle: dict[tuple[int, int], int] = {}

        def split(a: int, b: int, middle: dict[tuple[int, int], int] = middle) -> int:
            edge = (min(a, b), max(a, b))
            if edge not in middle:
                point = points[a] + points[b]
                points.append(point / np.linalg.norm(point))
                middle[edge] = len(points) - 1
            return middle[edge]

        finer = []
        for a, b, c in faces:
            ab, bc, ca = split(a, b), split(b, c), split(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    return np.array(points), np.array(faces, np.int64)


def _lumpy(random: Generator, levels: int, roughness: float, flattening: float) -> FloatArray:
    """Points of a sphere pushed in and out by a few random waves."""
    points, _ = _sphere(levels)
    radius = np.ones(len(points))
    for octave in range(1, 5):
        for _ in range(3):
            direction = random.standard_normal(3)
            radius += roughness / octave**1.5 * np.sin(1.7 * octave * (points @ direction) + random.uniform(0.0, 6.28))
    return np.asarray(np.maximum(radius, 0.4)[:, None] * points * np.array([1.0, 1.0, flattening]))


def _places(random: Generator, area: tuple[float, float, float, float], count: int) -> FloatArray:
    return np.column_stack([random.uniform(area[0], area[2], count), random.uniform(area[1], area[3], count)])


def rocks(item: objects.Rocks, height_at: HeightAt, keep_clear: tuple[float, float], random: Generator) -> Mesh:
    """Rocks half sunk into the ground; sizes follow a power law as they do on Mars. None where the vehicle stands."""
    places = _places(random, item.area_m, item.count)
    small, large = item.radius_m
    sizes = np.minimum(small * (1.0 - random.random(item.count)) ** (-1.0 / 1.8), large)
    base = height_at(places)
    parts = []
    for place, size, z in zip(places, sizes, base, strict=True):
        levels = 1 if size < _SMALL_ROCK_M else 2
        _, triangles = _sphere(levels)
        points = _lumpy(random, levels, 0.12, random.uniform(0.55, 0.9)) * size
        albedo = float(random.uniform(0.28, 0.5))
        if np.hypot(*(place - np.array(keep_clear))) < 1.0 + size:
            continue
        parts.append(mesh.indexed(points + np.array([*place, z + 0.15 * size]), triangles, item.material, albedo))
    return mesh.join(parts)


def trees(item: objects.Trees, height_at: HeightAt, random: Generator) -> Mesh:
    """Trunks with crowns of a few lumps."""
    places = _places(random, item.area_m, item.count)
    base = height_at(places)
    _, triangles = _sphere(2)
    parts = []
    for place, z in zip(places, base, strict=True):
        height = random.uniform(*item.height_m)
        albedo = float(random.uniform(0.15, 0.28))
        foot = np.array([*place, z])
        parts.append(mesh.tube(foot, foot + np.array([0.0, 0.0, 0.6 * height]), 0.03 * height, "wood", 0.25))
        for _ in range(3):
            radius = height * random.uniform(0.2, 0.3)
            offset = [*(random.standard_normal(2) * 0.12 * height), height - 1.1 * radius]
            crown = _lumpy(random, 2, 0.09, 0.85) * radius
            parts.append(mesh.indexed(crown + foot + offset, triangles, "leaves", albedo))
    return mesh.join(parts)


def pond(item: objects.Water, random: Generator) -> Mesh:
    """A level surface with a wavy shore inside a rectangle."""
    angles = 2.0 * np.pi * np.arange(_SHORE_POINTS) / _SHORE_POINTS
    reach = np.ones(_SHORE_POINTS)
    for waves in range(2, 7):
        reach += 0.25 / waves * np.sin(waves * angles + random.uniform(0.0, 2.0 * np.pi))
    reach *= 0.5 / reach.max()
    x = item.center_m[0] + item.size_m[0] * reach * np.cos(angles)
    y = item.center_m[1] + item.size_m[1] * reach * np.sin(angles)
    points = np.column_stack([np.r_[item.center_m[0], x], np.r_[item.center_m[1], y]])
    points = np.column_stack([points, np.full(len(points), item.level_m)])
    shore = np.arange(_SHORE_POINTS)
    fan = np.column_stack([np.zeros_like(shore), 1 + shore, 1 + (shore + 1) % _SHORE_POINTS])
    return mesh.indexed(points, fan, "water", None)
