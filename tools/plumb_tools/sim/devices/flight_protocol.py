"""What a simulated flight has to offer to be written as device bytes.

Stamps are in whole nanoseconds on the flight clock and increase strictly. Frames: W world (z up), I IMU, C camera
(z forward, x right, y down), R range finder. Quaternions are Hamilton, w x y z.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

#: Deviation of a quaternion or a beam from unit length that is still rounding.
_UNIT_TOLERANCE = 1e-6


class Calibration(Protocol):
    """Camera, and where camera and range finder sit."""

    @property
    def width(self) -> int:
        """Image width [px]."""

    @property
    def height(self) -> int:
        """Image height [px]."""

    @property
    def intrinsics(self) -> Sequence[float]:
        """fx, fy, cx, cy [px]; pixel centres at integer coordinates."""

    @property
    def distortion_model(self) -> str:
        """none, radial-tangential, equidistant or fov."""

    @property
    def distortion_coefficients(self) -> Sequence[float]:
        """Those of the model, as in the ASL format: at most four."""

    @property
    def q_IC_wxyz(self) -> Sequence[float]:
        """Rotates vectors from C to I."""

    @property
    def p_IC_m(self) -> Sequence[float]:
        """Origin of C in I."""

    @property
    def p_CR_m(self) -> Sequence[float]:
        """Origin of the range finder in C."""

    @property
    def u_C(self) -> Sequence[float]:
        """Unit vector of its beam in C."""


class Flight(Protocol):
    """Measurements as the sensors made them, errors and all, and the truth."""

    @property
    def calibration(self) -> Calibration:
        """The true one, or what the flight software is meant to believe."""

    @property
    def imu_t_ns(self) -> IntArray:
        """(N,) stamps of the IMU samples."""

    @property
    def imu_gyro_rad_s(self) -> FloatArray:
        """(N, 3) angular rate of I with respect to W, in I."""

    @property
    def imu_accel_m_s2(self) -> FloatArray:
        """(N, 3) specific force in I: at rest +g along the upward axis."""

    @property
    def range_t_ns(self) -> IntArray:
        """(M,) stamps of the ranges, at the middle of each measurement."""

    @property
    def range_m(self) -> FloatArray:
        """(M,) ranges; 0 means no return."""

    @property
    def images(self) -> Sequence[tuple[int, Path]]:
        """Mid-exposure stamp and 8-bit grey image file."""

    @property
    def truth_t_ns(self) -> IntArray:
        """(K,) stamps of the truth."""

    @property
    def truth_p_m(self) -> FloatArray:
        """(K, 3) origin of I in W."""

    @property
    def truth_q_wxyz(self) -> FloatArray:
        """(K, 4) rotates vectors from I to W."""

    @property
    def truth_v_m_s(self) -> FloatArray:
        """(K, 3) velocity of I in W."""


@runtime_checkable
class TrueBiases(Protocol):
    """What a flight may offer besides; without it the log says NaN."""

    @property
    def truth_b_gyro_rad_s(self) -> FloatArray:
        """(K, 3) true gyro bias at the stamps of the truth."""

    @property
    def truth_b_accel_m_s2(self) -> FloatArray:
        """(K, 3) true accelerometer bias at the stamps of the truth."""


@runtime_checkable
class ImageExposures(Protocol):
    """What a flight may offer besides; without it every image has the camera's default exposure."""

    @property
    def image_exposure_s(self) -> FloatArray:
        """(number of images,) exposure times."""

    @property
    def image_gain(self) -> FloatArray:
        """(number of images,) analogue gain, 1 and above."""


def check_flight(flight: Flight) -> None:
    """Raises ValueError that names the first member whose shape, order or values cannot be written."""
    _check_stamps(flight)
    _check_values(flight)
    for name, vector, size in (("q_IC_wxyz", flight.calibration.q_IC_wxyz, 4), ("u_C", flight.calibration.u_C, 3)):
        if np.shape(vector) != (size,) or not abs(float(np.linalg.norm(vector)) - 1.0) <= _UNIT_TOLERANCE:
            raise ValueError(f"calibration.{name}: expected {size} numbers of length 1")


def _check_stamps(flight: Flight) -> None:
    image_t_ns = np.array([t_ns for t_ns, _ in flight.images], dtype=np.int64)
    for name, t_ns in (
        ("imu_t_ns", flight.imu_t_ns),
        ("range_t_ns", flight.range_t_ns),
        ("images", image_t_ns),
        ("truth_t_ns", flight.truth_t_ns),
    ):
        if np.ndim(t_ns) != 1 or (len(t_ns) and t_ns[0] < 0) or np.any(np.diff(t_ns) <= 0):
            raise ValueError(f"{name}: expected stamps in ns from 0 on that increase strictly")
    if len(flight.imu_t_ns) < 2:
        raise ValueError("imu_t_ns: expected at least two samples")


def _check_values(flight: Flight) -> None:
    expected: list[tuple[str, FloatArray, tuple[int, ...]]] = [
        ("imu_gyro_rad_s", flight.imu_gyro_rad_s, (len(flight.imu_t_ns), 3)),
        ("imu_accel_m_s2", flight.imu_accel_m_s2, (len(flight.imu_t_ns), 3)),
        ("range_m", flight.range_m, (len(flight.range_t_ns),)),
        ("truth_p_m", flight.truth_p_m, (len(flight.truth_t_ns), 3)),
        ("truth_q_wxyz", flight.truth_q_wxyz, (len(flight.truth_t_ns), 4)),
        ("truth_v_m_s", flight.truth_v_m_s, (len(flight.truth_t_ns), 3)),
    ]
    if isinstance(flight, TrueBiases):
        expected.append(("truth_b_gyro_rad_s", flight.truth_b_gyro_rad_s, (len(flight.truth_t_ns), 3)))
        expected.append(("truth_b_accel_m_s2", flight.truth_b_accel_m_s2, (len(flight.truth_t_ns), 3)))
    if isinstance(flight, ImageExposures):
        expected.append(("image_exposure_s", flight.image_exposure_s, (len(flight.images),)))
        expected.append(("image_gain", flight.image_gain, (len(flight.images),)))
    for name, values, shape in expected:
        if np.shape(values) != shape or not np.all(np.isfinite(values)):
            raise ValueError(f"{name}: expected finite numbers of shape {shape}, found shape {np.shape(values)}")
    if np.any(np.abs(np.linalg.norm(flight.truth_q_wxyz, axis=1) - 1.0) > _UNIT_TOLERANCE):
        raise ValueError("truth_q_wxyz: expected unit quaternions")
