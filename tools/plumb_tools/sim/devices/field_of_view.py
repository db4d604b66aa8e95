"""The lens as a CALIBRATION record tells it: coefficients, and how far the image reaches in the normalised plane."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import root

from plumb_tools.sim.devices.flight_protocol import Calibration, FloatArray

#: Names of the models in the ASL format and their number in calibration_t.
DISTORTION_CODES = {"none": 0, "radial-tangential": 1, "equidistant": 2, "fov": 3}
COEFFICIENT_COUNT = {"none": 0, "radial-tangential": 4, "equidistant": 4, "fov": 1}

_PIXEL_TOLERANCE = 1e-6


def coefficients(calibration: Calibration) -> list[float]:
    """The four numbers of calibration_t; ValueError for an unknown model or a wrong number of coefficients."""
    model = calibration.distortion_model
    if model not in DISTORTION_CODES:
        raise ValueError(f"calibration.distortion_model: '{model}'; expected {', '.join(DISTORTION_CODES)}")
    given = [float(value) for value in calibration.distortion_coefficients]
    if len(given) != COEFFICIENT_COUNT[model]:
        raise ValueError(
            f"calibration.distortion_coefficients: {len(given)} numbers; {model} has {COEFFICIENT_COUNT[model]}"
        )
    return given + [0.0] * (4 - len(given))


def project(calibration: Calibration, normalised: FloatArray) -> FloatArray:
    """Pixel (2,) of a point (2,) of the undistorted normalised plane."""
    fx, fy, cx, cy = calibration.intrinsics
    k = coefficients(calibration)
    x, y = (float(value) for value in normalised)
    r = math.hypot(x, y)
    tangential = np.zeros(2)
    if calibration.distortion_model == "radial-tangential":
        radius = r * (1.0 + r**2 * (k[0] + r**2 * k[1]))
        tangential = np.array(
            [2.0 * k[2] * x * y + k[3] * (r**2 + 2.0 * x**2), k[2] * (r**2 + 2.0 * y**2) + 2.0 * k[3] * x * y]
        )
    elif calibration.distortion_model == "equidistant":
        theta = math.atan(r)
        radius = theta * (1.0 + sum(k[i] * theta ** (2 * i + 2) for i in range(4)))
    elif calibration.distortion_model == "fov":
        radius = math.atan(2.0 * r * math.tan(0.5 * k[0])) / k[0]
    else:
        radius = r
    distorted = np.array([x, y]) * (radius / r if r > 0.0 else 1.0) + tangential
    return distorted * (fx, fy) + (cx, cy)


def unproject(calibration: Calibration, pixel: FloatArray) -> FloatArray:
    """The inverse of `project`; ValueError where the lens model images nothing."""
    fx, fy, cx, cy = calibration.intrinsics
    start = (pixel - (cx, cy)) / (fx, fy)
    found = root(lambda normalised: project(calibration, normalised) - pixel, start, tol=1e-14)
    if np.max(np.abs(project(calibration, found.x) - pixel)) > _PIXEL_TOLERANCE:
        raise ValueError(f"calibration: the lens model images nothing at pixel {pixel.tolist()}")
    return np.asarray(found.x)


def half_field_of_view(calibration: Calibration) -> tuple[float, float]:
    """Half width and half height of the image in the normalised plane, from the middles of its four edges."""
    _, _, cx, cy = calibration.intrinsics
    left_right = [unproject(calibration, np.array([u, cy])) for u in (0.0, calibration.width - 1.0)]
    top_bottom = [unproject(calibration, np.array([cx, v])) for v in (0.0, calibration.height - 1.0)]
    edges = np.abs(np.array(left_right + top_bottom))
    half_width, half_height = edges.max(axis=0)
    return float(half_width), float(half_height)
