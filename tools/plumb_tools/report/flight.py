"""A flight folder (ASL layout) as the report needs it: images, truth, range finder and calibration."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from plumb_tools.report.camera import Camera
from plumb_tools.trajectory import (
    ASL_IMAGES,
    ASL_TRUTH,
    NS_PER_S,
    FloatArray,
    InputError,
    IntArray,
    Truth,
    data_lines,
    read_csv,
    read_text,
    read_truth,
)

CAMERA_FILE = Path("mav0/cam0/sensor.yaml")
IMU_FILE = Path("mav0/imu0/sensor.yaml")
RANGE_FILE = Path("mav0/range0/sensor.yaml")
RANGE_DATA = Path("mav0/range0/data.csv")
IMAGE_FOLDER = Path("mav0/cam0/data")

#: Written with few digits, a rotation is one only so far.
_ROTATION_TOLERANCE = 1e-3


@dataclass(frozen=True)
class RangeFinder:
    """Samples of the range finder and how it is mounted."""

    t_ns: IntArray
    range_m: FloatArray  #: 0: no return
    origin_C_m: FloatArray  #: (3,) in the camera frame
    beam_C: FloatArray  #: (3,) unit vector
    noise_m: float
    max_range_m: float


@dataclass(frozen=True)
class Flight:
    """A recorded or simulated flight."""

    folder: Path
    t_images_ns: IntArray
    image_files: list[Path]
    camera: Camera
    q_IC: Rotation  #: rotates vectors from the camera to the IMU frame
    p_IC_m: FloatArray  #: origin of the camera in the IMU frame
    truth: Truth | None
    range_finder: RangeFinder | None

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.resolve().name

    def seconds(self, t_ns: IntArray) -> FloatArray:
        """Time since the first image [s], the time axis of every figure."""
        return np.asarray((t_ns - self.t_images_ns[0]) / NS_PER_S, dtype=np.float64)

    def beam_points_I_m(self, range_m: FloatArray) -> FloatArray:
        """Where ranges (N,) end, in the IMU frame, (N, 3)."""
        assert self.range_finder is not None
        points_C = self.range_finder.origin_C_m + range_m[:, None] * self.range_finder.beam_C
        return np.asarray(self.q_IC.apply(points_C) + self.p_IC_m)


def read_flight(folder: Path) -> Flight:
    """Reads an ASL folder; truth and range finder may be absent, the rest may not."""
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; --flight takes the folder that holds mav0")
    t_ns, files = _read_images(folder)
    camera_yaml = _read_yaml(folder / CAMERA_FILE)
    imu_yaml = _read_yaml(folder / IMU_FILE)
    body_C = _transform(camera_yaml, folder / CAMERA_FILE)
    body_I = _transform(imu_yaml, folder / IMU_FILE)
    pose_IC = np.linalg.inv(body_I) @ body_C
    return Flight(
        folder,
        t_ns,
        files,
        _camera(camera_yaml, folder / CAMERA_FILE),
        Rotation.from_matrix(pose_IC[:3, :3]),
        pose_IC[:3, 3],
        read_truth(folder) if (folder / ASL_TRUTH).exists() else None,
        _read_range_finder(folder) if (folder / RANGE_DATA).exists() else None,
    )


def _read_images(folder: Path) -> tuple[IntArray, list[Path]]:
    path = folder / ASL_IMAGES
    if not path.is_file():
        raise InputError(f"{folder}: not an ASL folder: {ASL_IMAGES} is missing")
    stamps, files = [], []
    for number, line in data_lines(read_text(path)):
        fields = line.split(",")
        if len(fields) < 2 or not fields[0].strip().isdigit():
            raise InputError(f"{path}:{number}: expected a stamp in nanoseconds and a file name")
        stamps.append(int(fields[0]))
        files.append(folder / IMAGE_FOLDER / fields[1].strip())
    if not stamps:
        raise InputError(f"{path}: names no image")
    return np.array(stamps, dtype=np.int64), files


def _read_yaml(path: Path) -> dict[str, Any]:
    try:
        content = yaml.safe_load(read_text(path))
    except yaml.YAMLError as error:
        raise InputError(f"{path}: {error}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: holds no keys")
    return content


def _numbers(content: dict[str, Any], key: str, count: int, path: Path) -> list[float]:
    values = content.get(key)
    try:
        numbers = [float(value) for value in values] if isinstance(values, list) else []
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) < count:
        raise InputError(f"{path}: {key}: expected {count} numbers")
    return numbers


def _transform(content: dict[str, Any], path: Path) -> FloatArray:
    """T_BS: from the sensor to the body frame, (4, 4)."""
    pose = content.get("T_BS")
    if not isinstance(pose, dict):
        raise InputError(f"{path}: T_BS is missing; expected the pose of the sensor in the body")
    matrix = np.array(_numbers(pose, "data", 16, path)[:16], dtype=np.float64).reshape(4, 4)
    turn = matrix[:3, :3]
    if not np.allclose(turn @ turn.T, np.eye(3), atol=_ROTATION_TOLERANCE) or np.linalg.det(turn) < 0.0:
        raise InputError(f"{path}: T_BS.data: its upper left 3 x 3 is not a rotation; expected a pose by rows")
    return matrix


def _camera(content: dict[str, Any], path: Path) -> Camera:
    width, height = _numbers(content, "resolution", 2, path)[:2]
    fx, fy, cx, cy = _numbers(content, "intrinsics", 4, path)[:4]
    distortion = str(content.get("distortion_model", "none"))
    count = {"none": 0, "fov": 1}.get(distortion, 4)
    coefficients = _numbers(content, "distortion_coefficients", count, path) if count else []
    return Camera(int(width), int(height), (fx, fy, cx, cy), distortion, tuple(coefficients))


def _read_range_finder(folder: Path) -> RangeFinder:
    path = folder / RANGE_FILE
    content = _read_yaml(path)
    data = read_csv(folder / RANGE_DATA, "timestamp", ("range",))
    scalars = []
    for key in ("noise_stddev_m", "max_range_m"):
        if not isinstance(content.get(key), int | float):
            raise InputError(f"{path}: {key}: expected a number")
        scalars.append(float(content[key]))
    return RangeFinder(
        data.t_ns,
        data.columns["range"],
        np.array(_numbers(content, "origin_in_cam_m", 3, path)),
        np.array(_numbers(content, "axis_in_cam", 3, path)),
        *scalars,
    )
