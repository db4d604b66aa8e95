"""What one simulated flight holds: what the sensors said and what was true.

Frames and units as in docs: world W has z up, I is the IMU, C the camera, quaternions are Hamilton w x y z and rotate
from I to W. All stamps are nanoseconds of the flight computer's clock; sensor stamps carry the clock offset and jitter
of the scene, truth stamps carry none.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

import numpy as np
import numpy.typing as npt

from plumb_tools.sim.scene import Scene
from plumb_tools.trajectory import FloatArray, IntArray

#: Flight clock at the start of a trajectory. Not zero, so that nobody can confuse the two.
EPOCH_NS = 1_000_000_000_000


class RangeStatus(IntEnum):
    """What a laser range finder says about one measurement."""

    VALID = 0
    NO_RETURN = 1  #: too little light came back: nothing hit, water, drop-out
    OUT_OF_LIMITS = 2  #: something was hit nearer or further than the device can tell


@dataclass(frozen=True)
class ImuData:
    """Samples of the IMU in frame I, errors included."""

    t_ns: IntArray  #: (N,) stamps
    gyro_rad_s: FloatArray  #: (N, 3) angular rate
    accel_m_s2: FloatArray  #: (N, 3) specific force


@dataclass(frozen=True)
class RangeData:
    """Samples of the laser range finder."""

    t_ns: IntArray  #: (N,) stamps
    range_m: FloatArray  #: (N,) 0 where the status is not VALID
    status: npt.NDArray[np.uint8]  #: (N,) RangeStatus


@dataclass(frozen=True)
class Calibration:
    """Camera, and where camera and range finder sit."""

    width: int
    height: int
    intrinsics: tuple[float, float, float, float]  #: fx fy cx cy [px]
    distortion_model: str
    distortion_coefficients: tuple[float, ...]  #: as many as the model has
    q_IC_wxyz: tuple[float, ...]
    p_IC_m: tuple[float, ...]
    p_CR_m: tuple[float, ...]
    u_C: tuple[float, ...]


@dataclass(frozen=True)
class SimulatedFlight:
    """One flight, complete. The names are those that `devices` writes device bytes from."""

    scene: Scene  #: as flown, every default filled in
    seed: int
    calibration: Calibration
    imu_t_ns: IntArray  #: (N,)
    imu_gyro_rad_s: FloatArray  #: (N, 3)
    imu_accel_m_s2: FloatArray  #: (N, 3)
    range_t_ns: IntArray  #: (M,)
    range_m: FloatArray  #: (M,) 0 is no return
    range_status: npt.NDArray[np.uint8]  #: (M,) RangeStatus
    images: list[tuple[int, Path]]  #: stamp of the middle of the exposure, 8-bit grey PNG
    image_exposure_s: FloatArray  #: one per image
    image_gain: FloatArray  #: one per image, 1 and above
    truth_t_ns: IntArray  #: (K,) true time
    truth_p_m: FloatArray  #: (K, 3) origin of I in W
    truth_q_wxyz: FloatArray  #: (K, 4)
    truth_v_m_s: FloatArray  #: (K, 3) velocity of I in W
    truth_b_gyro_rad_s: FloatArray  #: (K, 3)
    truth_b_accel_m_s2: FloatArray  #: (K, 3)
