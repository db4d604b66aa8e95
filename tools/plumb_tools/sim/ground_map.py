"""What is painted on the ground: its albedo and material at every point, roads, patches, and the shadows cast on it."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import cast

import cv2
import numpy as np
import numpy.typing as npt

from plumb_tools.sim import noise, objects
from plumb_tools.sim.materials import INDEX, MATERIALS
from plumb_tools.sim.mesh import Float32
from plumb_tools.sim.nature import HeightAt
from plumb_tools.sim.scene import Ground
from plumb_tools.sim.streams import Generator
from plumb_tools.sim.textures import read_picture
from plumb_tools.trajectory import FloatArray

_SHIFT = 4  #: binary places of pixel coordinates that OpenCV draws with

#: Rows of rays cast at once.
_SHADOW_ROWS = 256


@dataclass(frozen=True)
class GroundMap:
    """Pictures of the ground rectangle; row 0 lies along the lower y edge."""

    extent_m: tuple[float, float, float, float]
    albedo: npt.NDArray[np.uint8]  #: (H, W) in 1/255
    material: npt.NDArray[np.uint8]  #: (H, W) material numbers
    sunlit: npt.NDArray[np.uint8]  #: (H, W) 255 in the sun, 0 in shadow


class GroundPainter:
    """Paints a ground map layer by layer."""

    def __init__(self, ground: Ground, random: Generator) -> None:
        """Starts with the bare ground."""
        self._ground = ground
        x0, y0, x1, y1 = ground.extent_m
        self._columns = int(np.ceil((x1 - x0) / ground.map_m_per_px))
        self._rows = int(np.ceil((y1 - y0) / ground.map_m_per_px))
        self._px_per_m = np.array([self._columns / (x1 - x0), self._rows / (y1 - y0)])
        self._wear = self._square(random)
        base = ground.albedo * (1.0 + 0.22 * ground.contrast * self._cut(self._square(random)))
        self.albedo: Float32 = np.maximum(base, 0.1 * ground.albedo)
        self.material = np.full(self.albedo.shape, INDEX[ground.material], np.uint8)

    def _square(self, random: Generator) -> Float32:
        """Periodic noise at half the map's resolution, from a third of its size to a few pixels; finer detail comes
        from the materials' layers.
        """
        side = 1 << int(np.ceil(np.log2(0.5 * max(self._columns, self._rows))))
        return noise.fractal(random, (side, side), 1.12, low=3.0)

    def _cut(self, square: Float32) -> Float32:
        """As much of a square as the map needs, at its resolution."""
        part = square[: -(-self._rows // 2), : -(-self._columns // 2)]
        return cast(Float32, cv2.resize(part, (self._columns, self._rows), interpolation=cv2.INTER_CUBIC))

    def _worn(self, item: objects.Road | objects.Patch) -> Float32:
        """Wear of one item: the map's, moved to where nothing else shows the same."""
        shift = zlib.crc32(repr(item).encode())
        side = len(self._wear)
        return self._cut(np.roll(self._wear, (shift % side, (shift >> 12) % side), axis=(0, 1)))

    def _pixels(self, points_m: FloatArray) -> npt.NDArray[np.int32]:
        px = (np.asarray(points_m) - np.array(self._ground.extent_m[:2])) * self._px_per_m - 0.5
        return np.asarray(np.round(px * (1 << _SHIFT)).astype(np.int32))

    def _blend(self, mask: Float32, material: str, albedo: Float32 | float) -> None:
        self.albedo = np.asarray(self.albedo * (1.0 - mask) + mask * albedo, np.float32)
        self.material[mask > 0.5] = INDEX[material]

    def orthophotos(self, paths: list[Path]) -> None:
        """The user's pictures side by side, mirrored where they end, brought to the ground's mean albedo."""
        scale = self._ground.orthophoto_m_per_px * float(self._px_per_m.mean())
        pictures = [read_picture(path) for path in paths]
        height = min(picture.shape[0] for picture in pictures)
        strip: Float32 = np.hstack([picture[:height] for picture in pictures])
        size = max(8, round(strip.shape[1] * scale)), max(8, round(strip.shape[0] * scale))
        method = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
        strip = np.asarray(cv2.resize(strip, size, interpolation=method), np.float32)
        mirrored = np.block([[strip, strip[:, ::-1]], [strip[::-1], strip[::-1, ::-1]]])
        repeats = -(-self._rows // mirrored.shape[0]), -(-self._columns // mirrored.shape[1])
        picture = np.tile(mirrored, repeats)[: self._rows, : self._columns]
        self.albedo = (self._ground.albedo * picture / max(float(picture.mean()), 1.0)).astype(np.float32)

    def road(self, item: objects.Road, random: Generator) -> None:
        """A strip with worn edges, kerbs and a dashed line in the middle."""
        line = self._pixels(np.array(item.points_m)).reshape(-1, 1, 2)
        base = MATERIALS[item.material].albedo
        wear = self._worn(item)
        kerb = self._strip(line, item.width_m + 0.5)
        self._blend(kerb, "concrete", MATERIALS["concrete"].albedo * (1.0 + 0.1 * wear))
        paved = self._strip(line, item.width_m)
        self._blend(paved, item.material, base * (1.0 + 0.16 * wear))
        if item.width_m >= 4.0:
            self._markings(np.array(item.points_m), item.width_m)
        self._covers(np.array(item.points_m), item.width_m, random)

    def _strip(self, line: npt.NDArray[np.int32], width_m: float) -> Float32:
        mask = np.zeros((self._rows, self._columns), np.uint8)
        thickness = max(1, round(width_m * float(self._px_per_m.mean())))
        cv2.polylines(mask, [line], False, 255, thickness, cv2.LINE_AA, _SHIFT)
        return cv2.GaussianBlur(mask, (0, 0), 0.8).astype(np.float32) / 255.0

    def _markings(self, points: FloatArray, width_m: float) -> None:
        """Dashes 3 m long every 6 m, and a line along each edge."""
        mask = np.zeros((self._rows, self._columns), np.uint8)
        for a, b in pairwise(points):
            length = float(np.linalg.norm(b - a))
            along = (b - a) / length
            across = np.array([-along[1], along[0]])
            for s in np.arange(1.5, length - 3.0, 6.0):
                self._quad(mask, a + s * along, a + (s + 3.0) * along, 0.075 * across)
            for side in (0.5 * width_m - 0.3, 0.3 - 0.5 * width_m):
                self._quad(mask, a + side * across, b + side * across, 0.06 * across)
        worn = cv2.GaussianBlur(mask, (0, 0), 0.6).astype(np.float32) / 255.0 * 0.85
        self.albedo = self.albedo * (1.0 - worn) + worn * MATERIALS["paint"].albedo

    def _quad(self, mask: npt.NDArray[np.uint8], a: FloatArray, b: FloatArray, half: FloatArray) -> None:
        cv2.fillPoly(mask, [self._pixels(np.array([a - half, b - half, b + half, a + half]))], 255, cv2.LINE_AA, _SHIFT)

    def _covers(self, points: FloatArray, width_m: float, random: Generator) -> None:
        """Repaired squares and manhole covers."""
        patch = np.zeros((self._rows, self._columns), np.uint8)
        for a, b in pairwise(points):
            for _ in range(int(np.linalg.norm(b - a) / 7.0) + 1):
                along = (b - a) / np.linalg.norm(b - a)
                across = np.array([-along[1], along[0]])
                center = a + random.random() * (b - a) + random.uniform(-0.35, 0.35) * width_m * across
                if random.random() < 0.5:
                    radius = round(0.32 * float(self._px_per_m.mean()) * (1 << _SHIFT))
                    cv2.circle(patch, self._pixels(center).tolist(), radius, 220, -1, cv2.LINE_AA, _SHIFT)
                else:
                    half = random.uniform(0.3, 1.0) * across
                    self._quad(patch, center, center + random.uniform(0.6, 3.0) * along, half)
        worn = cv2.GaussianBlur(patch, (0, 0), 0.5).astype(np.float32) / 255.0
        self.albedo = np.asarray(self.albedo * (1.0 - 0.45 * worn), np.float32)

    def patch(self, item: objects.Patch) -> None:
        """A blob with a ragged edge."""
        y, x = np.mgrid[0 : self._rows, 0 : self._columns].astype(np.float32)
        center = self._pixels(np.array(item.center_m)) / (1 << _SHIFT)
        distance = np.hypot((x - center[0]) / self._px_per_m[0], (y - center[1]) / self._px_per_m[1])
        wear = self._worn(item)
        ragged = (item.radius_m - distance) / item.radius_m + 0.25 * wear[::-1]
        mask = np.clip(0.5 + ragged * item.radius_m * 2.0, 0.0, 1.0).astype(np.float32)
        self._blend(mask, item.material, MATERIALS[item.material].albedo * (1.0 + 0.2 * wear))

    def finish(self, occluded: Callable[[FloatArray], npt.NDArray[np.bool_]], height_at: HeightAt) -> GroundMap:
        """The map with its shadows. `occluded`: whether the sun is hidden from points (N, 3)."""
        x0, y0, _, _ = self._ground.extent_m
        columns = x0 + (np.arange(self._columns) + 0.5) / self._px_per_m[0]
        shadow = np.zeros((self._rows, self._columns), np.float32)
        for first in range(0, self._rows, _SHADOW_ROWS):
            rows = y0 + (np.arange(first, min(first + _SHADOW_ROWS, self._rows)) + 0.5) / self._px_per_m[1]
            xy = np.column_stack([np.tile(columns, len(rows)), np.repeat(rows, len(columns))])
            points = np.column_stack([xy, height_at(xy) + 0.02])
            shadow[first : first + len(rows)] = occluded(points).reshape(len(rows), -1)
        lit = 1.0 - cv2.GaussianBlur(shadow, (0, 0), 1.0)
        return GroundMap(
            self._ground.extent_m,
            np.clip(255.0 * self.albedo + 0.5, 1.0, 255.0).astype(np.uint8),
            self.material,
            np.clip(255.0 * lit + 0.5, 0.0, 255.0).astype(np.uint8),
        )
