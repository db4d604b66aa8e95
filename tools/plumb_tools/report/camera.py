"""Camera model of an ASL folder: where a point or the laser beam is in the image, and the ray of a pixel.

Camera frame C: z forward, x right, y down. The models are those of plumb-replay: pinhole with radial-tangential,
equidistant, fov or no distortion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plumb_tools.trajectory import FloatArray

RADIAL_TANGENTIAL = ("radial-tangential", "radtan", "plumb_bob")
_UNDISTORT_STEPS = 12
_DIFFERENCE = 1e-6  #: of the numeric Jacobian, on the plane z = 1
_SMALL_RADIUS = 1e-9


@dataclass(frozen=True)
class Camera:
    """Intrinsics in pixels and the lens."""

    width: int
    height: int
    intrinsics: tuple[float, float, float, float]  #: fx, fy, cx, cy
    distortion: str
    coefficients: tuple[float, ...]

    def lens(self, plane: FloatArray) -> FloatArray:
        """Distorted from ideal points on the plane z = 1, both (N, 2)."""
        x, y = plane.T
        r2 = x * x + y * y
        if self.distortion in RADIAL_TANGENTIAL:
            k1, k2, p1, p2 = self.coefficients[:4]
            radial = 1.0 + r2 * (k1 + r2 * k2)
            dx = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
            dy = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
            return np.column_stack([x * radial + dx, y * radial + dy])
        return plane * self._radial_factor(np.sqrt(r2))[:, None]

    def _radial_factor(self, r: FloatArray) -> FloatArray:
        """Distorted over ideal distance from the axis."""
        safe = np.maximum(r, _SMALL_RADIUS)
        if self.distortion == "equidistant":
            theta = np.arctan(safe)
            gain = np.polynomial.polynomial.polyval(theta**2, [1.0, *self.coefficients[:4]])
            return np.asarray(theta * gain / safe)
        if self.distortion == "fov":
            w = self.coefficients[0]
            return np.asarray(np.arctan(2.0 * safe * np.tan(0.5 * w)) / (w * safe))
        return np.ones_like(r)

    def project(self, points_C_m: FloatArray) -> FloatArray:
        """Pixels (N, 2) of points (N, 3) in C; NaN where a point is not in front."""
        front = points_C_m[:, 2] > 0.0
        depth = np.where(front, points_C_m[:, 2], np.nan)
        fx, fy, cx, cy = self.intrinsics
        return np.asarray(self.lens(points_C_m[:, :2] / depth[:, None]) * [fx, fy] + [cx, cy])

    def undistort(self, pixels: FloatArray) -> FloatArray:
        """Ideal points (N, 2) on the plane z = 1 of pixels (N, 2), by Newton's method."""
        fx, fy, cx, cy = self.intrinsics
        target = (pixels - [cx, cy]) / [fx, fy]
        plane = target.copy()
        for _ in range(_UNDISTORT_STEPS):
            here = self.lens(plane)
            by_x = (self.lens(plane + [_DIFFERENCE, 0.0]) - here) / _DIFFERENCE
            by_y = (self.lens(plane + [0.0, _DIFFERENCE]) - here) / _DIFFERENCE
            jacobian = np.stack([by_x, by_y], axis=2)
            plane = plane + np.linalg.solve(jacobian, (target - here)[:, :, None])[:, :, 0]
        return plane
