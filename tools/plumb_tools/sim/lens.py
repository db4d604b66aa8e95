"""Lens models: normalised plane z = 1 of frame C to pixels and back. Pixel centres are at integer coordinates."""

from __future__ import annotations

import numpy as np

from plumb_tools.sim.sensors import Lens
from plumb_tools.trajectory import FloatArray

_ITERATIONS = 50
_TOLERANCE_PX = 1e-6  #: the contract is 1e-3
_STEP = 1e-6  #: of the numerical Jacobian


def _equidistant(r: FloatArray, k: tuple[float, ...]) -> FloatArray:
    theta = np.arctan(r)
    t2 = theta * theta
    return np.asarray(theta * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3])))))


def distort(lens: Lens, normalised: FloatArray) -> FloatArray:
    """Lens alone: (N, 2) in the normalised plane to the distorted normalised plane."""
    x, y = normalised[:, 0], normalised[:, 1]
    k = lens.coefficients
    r2 = x * x + y * y
    if lens.model == "radial-tangential":
        radial = 1.0 + r2 * (k[0] + r2 * k[1])
        dx = 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x)
        dy = k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y
        return np.column_stack([radial * x + dx, radial * y + dy])
    if lens.model == "none":
        return normalised
    r = np.maximum(np.sqrt(r2), 1e-12)
    if lens.model == "equidistant":
        factor = _equidistant(r, k) / r
    else:
        factor = np.arctan(2.0 * r * np.tan(0.5 * k[0])) / (k[0] * r)
    return normalised * factor[:, None]


def project(lens: Lens, normalised: FloatArray) -> FloatArray:
    """(N, 2) in the normalised plane to distorted pixels (N, 2)."""
    return np.asarray(distort(lens, normalised) * np.array(lens.focal_px) + np.array(lens.center_px))


def unproject(lens: Lens, pixels: FloatArray) -> FloatArray:
    """Distorted pixels (N, 2) to the normalised plane (N, 2) by Newton's method; not a number where it fails."""
    target = (np.asarray(pixels, np.float64) - np.array(lens.center_px)) / np.array(lens.focal_px)
    n = target.copy()
    for _ in range(_ITERATIONS):
        value = distort(lens, n)
        error = target - value
        along_x = (distort(lens, n + np.array([_STEP, 0.0])) - value) / _STEP
        along_y = (distort(lens, n + np.array([0.0, _STEP])) - value) / _STEP
        determinant = along_x[:, 0] * along_y[:, 1] - along_y[:, 0] * along_x[:, 1]
        determinant = np.where(determinant > 0.05, determinant, np.inf)
        dx = (along_y[:, 1] * error[:, 0] - along_y[:, 0] * error[:, 1]) / determinant
        dy = (along_x[:, 0] * error[:, 1] - along_x[:, 1] * error[:, 0]) / determinant
        n = n + np.column_stack([dx, dy])
        if np.nanmax(np.abs(error)) * max(lens.focal_px) < _TOLERANCE_PX:
            break
    off = np.abs(project(lens, n) - pixels).max(axis=1) > 1e-3
    n[off] = np.nan
    return np.asarray(n)


def half_widths(lens: Lens, size_px: tuple[int, int]) -> FloatArray:
    """How far the image reaches in the normalised plane: (left, right, up, down), all positive; not a number when
    the lens cannot be inverted at its edge.
    """
    width, height = size_px
    across = np.arange(-0.5, width, 0.5)
    down = np.arange(-0.5, height, 0.5)
    edge = np.concatenate(
        [
            np.column_stack([across, np.full_like(across, -0.5)]),
            np.column_stack([across, np.full_like(across, height - 0.5)]),
            np.column_stack([np.full_like(down, -0.5), down]),
            np.column_stack([np.full_like(down, width - 0.5), down]),
        ]
    )
    n = unproject(lens, edge)
    return np.array([-n[:, 0].min(), n[:, 0].max(), -n[:, 1].min(), n[:, 1].max()])
