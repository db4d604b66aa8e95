"""Reads what Kalibr writes: camchain-imucam.yaml of a camera on an IMU, and imu.yaml of the IMU's noise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from plumb_tools.sim.schema import NOT_THERE, Faults, said
from plumb_tools.trajectory import FloatArray, InputError
from plumb_tools.yaml_text import read_yaml

#: Kalibr's name of a lens model, Plumb's, and how many coefficients it has.
DISTORTION = {
    "radtan": ("radial-tangential", 4),
    "equidistant": ("equidistant", 4),
    "fov": ("fov", 1),
    "none": ("none", 0),
}

NOISE_KEYS = (
    "gyroscope_noise_density",
    "gyroscope_random_walk",
    "accelerometer_noise_density",
    "accelerometer_random_walk",
)

#: A rotation further from orthonormal is a fault of the file, not rounding.
ORTHONORMAL_TOLERANCE = 1e-3
LONGEST_LEVER_M = 50.0
LARGEST_SHIFT_S = 1.0


@dataclass(frozen=True)
class Camera:
    """A pinhole camera on an IMU."""

    T_IC: FloatArray  #: takes points from the camera's frame to the IMU's, 4 x 4
    resolution: tuple[int, int]  #: px
    intrinsics: tuple[float, ...]  #: fx, fy, cx, cy, px
    distortion_model: str  #: as Plumb calls it
    distortion_coefficients: tuple[float, ...]
    shift_s: float  #: to be added to an image's stamp, to be on the IMU's clock


@dataclass(frozen=True)
class Imu:
    """Noise of an IMU, in SI units, by the keys of `NOISE_KEYS`."""

    noise: dict[str, float]
    rate_hz: float


class _Map:
    """A map of a file, whose faults are collected."""

    def __init__(self, content: dict[str, Any], prefix: str, faults: Faults) -> None:
        self._content, self._prefix, self._faults = content, prefix, faults

    def has(self, key: str) -> bool:
        return key in self._content

    def fault(self, key: str, expected: str) -> None:
        self._faults.add(self._prefix + key, self._content.get(key, NOT_THERE), expected)

    def number(self, key: str, expected: str, low: float = -math.inf, high: float = math.inf) -> float:
        value = self._content.get(key)
        if _is_number(value) and low <= value <= high:
            return float(value)
        self.fault(key, expected)
        return math.nan

    def numbers(self, key: str, count: int, expected: str) -> tuple[float, ...]:
        value = self._content.get(key)
        if isinstance(value, list) and len(value) == count and all(_is_number(one) for one in value):
            return tuple(float(one) for one in value)
        self.fault(key, expected)
        return (math.nan,) * count

    def one_of(self, key: str, names: tuple[str, ...]) -> str:
        value = self._content.get(key)
        if value in names:
            return str(value)
        self.fault(key, f"one of {', '.join(names)}")
        return names[0]

    def transform(self, key: str) -> FloatArray:
        """A rigid transform, its rotation made orthonormal to the last digit."""
        expected = "four rows of four numbers: a rotation, a translation in m (less than 50), and 0 0 0 1"
        rows = self._content.get(key)
        if not (isinstance(rows, list) and len(rows) == 4 and all(map(_is_row, rows))):
            self.fault(key, expected)
            return np.eye(4)
        matrix = np.array(rows, dtype=np.float64)
        rotation = matrix[:3, :3]
        error = np.linalg.norm(rotation @ rotation.T - np.eye(3))
        is_rigid = error < ORTHONORMAL_TOLERANCE and np.linalg.det(rotation) > 0.0
        if not is_rigid or list(matrix[3]) != [0, 0, 0, 1] or np.linalg.norm(matrix[:3, 3]) >= LONGEST_LEVER_M:
            self.fault(key, expected)
            return np.eye(4)
        matrix[:3, :3] = Rotation.from_matrix(rotation).as_matrix()
        return matrix


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _is_row(value: object) -> bool:
    return isinstance(value, list) and len(value) == 4 and all(map(_is_number, value))


def _section(path: Path, key: str, expected: str, optional: bool = False) -> dict[str, Any]:
    """The map under a key of a file, or where it may be missing the file's own."""
    content = read_yaml(path)
    if not isinstance(content, dict):
        raise InputError(f"{path}: is no map; expected {expected}")
    found = content.get(key, content if optional else None)
    if not isinstance(found, dict):
        there = ", ".join(str(name) for name in content) or "nothing"
        raise InputError(f"{path}: {key}: is no section, it has {there}; expected {expected}")
    return found


def _refuse(path: Path, faults: Faults) -> None:
    if faults:
        raise InputError("\n".join(f"{path}: {fault}" for fault in faults.items))


def read_camera(path: Path, name: str = "cam0") -> Camera:
    """A camera of camchain-imucam.yaml; InputError tells of everything that is wrong with it."""
    faults = Faults()
    of = _Map(_section(path, name, "the camchain-imucam.yaml of kalibr_calibrate_imu_camera"), f"{name}.", faults)
    of.one_of("camera_model", ("pinhole",))
    kalibr_model = of.one_of("distortion_model", tuple(DISTORTION))
    model, count = DISTORTION[kalibr_model]
    coefficients = of.numbers("distortion_coeffs", count, f"{count} numbers, as {kalibr_model} has") if count else ()
    intrinsics = of.numbers("intrinsics", 4, "fx, fy, cx, cy in px")
    resolution = of.numbers("resolution", 2, "width and height in px")
    if not all(math.isnan(side) or (side >= 1.0 and side == math.floor(side)) for side in resolution):
        of.fault("resolution", "width and height in whole px")
    elif not all(math.isnan(value) or value > 0.0 for value in intrinsics[:2]):
        of.fault("intrinsics", "focal lengths above 0 px")
    elif any(centre < 0.0 or centre > side for centre, side in zip(intrinsics[2:], resolution, strict=True)):
        of.fault("intrinsics", f"a principal point within {resolution[0]:g} x {resolution[1]:g} px")
    transform = _camera_in_imu(of, faults, name)
    shift_s = 0.0
    if of.has("timeshift_cam_imu"):
        expected = f"seconds to be added to an image's stamp, {-LARGEST_SHIFT_S:g} to {LARGEST_SHIFT_S:g}"
        shift_s = of.number("timeshift_cam_imu", expected, -LARGEST_SHIFT_S, LARGEST_SHIFT_S)
    _refuse(path, faults)
    return Camera(transform, (int(resolution[0]), int(resolution[1])), intrinsics, model, coefficients, shift_s)


def _camera_in_imu(of: _Map, faults: Faults, name: str) -> FloatArray:
    """T_IC, from Kalibr's T_cam_imu, which takes points the other way, or from OpenVINS' T_imu_cam, which does not."""
    if of.has("T_cam_imu") and of.has("T_imu_cam"):
        faults.add(f"{name}.T_imu_cam", said("beside T_cam_imu"), "one of the two: they are inverses of each other")
    elif of.has("T_imu_cam"):
        return of.transform("T_imu_cam")
    elif of.has("T_cam_imu"):
        T_CI = of.transform("T_cam_imu")
        T_IC = np.eye(4)
        T_IC[:3, :3] = T_CI[:3, :3].T
        T_IC[:3, 3] = -T_CI[:3, :3].T @ T_CI[:3, 3]
        return T_IC
    else:
        of.fault("T_cam_imu", "a calibration with the IMU (camchain-imucam.yaml), not of the cameras alone")
    return np.eye(4)


def read_imu(path: Path, name: str = "imu0") -> Imu:
    """An IMU of imu.yaml, with or without a section of its name; InputError tells of everything that is wrong."""
    faults = Faults()
    of = _Map(_section(path, name, "the imu.yaml of Kalibr", optional=True), "", faults)
    noise = {key: of.number(key, "a number above 0, in SI units", low=math.ulp(0.0)) for key in NOISE_KEYS}
    rate_hz = of.number("update_rate", "samples a second, above 0", low=math.ulp(0.0))
    if of.has("T_i_b") and not np.allclose(of.transform("T_i_b"), np.eye(4), atol=1e-9):
        of.fault("T_i_b", "the identity: the IMU that the camera's T_cam_imu is about")
    _refuse(path, faults)
    return Imu(noise, rate_hz)
