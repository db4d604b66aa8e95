"""A small made-up flight to be written as device bytes: all of it is noise, so that no two numbers are alike."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

SEED = 20260102
START_NS = 5_000_000_123
WIDTH, HEIGHT = 64, 48


@dataclass(frozen=True)
class MadeUpCalibration:
    width: int = WIDTH
    height: int = HEIGHT
    intrinsics: tuple[float, ...] = (40.0, 41.0, 31.0, 24.5)
    distortion_model: str = "radial-tangential"
    distortion_coefficients: tuple[float, ...] = (-0.28, 0.07, 2e-4, -1e-4)
    q_IC_wxyz: tuple[float, ...] = (0.5, -0.5, 0.5, -0.5)
    p_IC_m: tuple[float, ...] = (0.1, -0.02, 0.03)
    p_CR_m: tuple[float, ...] = (0.05, 0.0, -0.01)
    u_C: tuple[float, ...] = (0.0, 0.6, 0.8)


@dataclass
class MadeUpFlight:
    imu_t_ns: npt.NDArray[np.int64]
    imu_gyro_rad_s: npt.NDArray[np.float64]
    imu_accel_m_s2: npt.NDArray[np.float64]
    range_t_ns: npt.NDArray[np.int64]
    range_m: npt.NDArray[np.float64]
    truth_t_ns: npt.NDArray[np.int64]
    truth_p_m: npt.NDArray[np.float64]
    truth_q_wxyz: npt.NDArray[np.float64]
    truth_v_m_s: npt.NDArray[np.float64]
    images: list[tuple[int, Path]] = field(default_factory=list)
    calibration: MadeUpCalibration = field(default_factory=MadeUpCalibration)


@dataclass
class CompleteFlight(MadeUpFlight):
    """With what a flight may offer besides."""

    truth_b_gyro_rad_s: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    truth_b_accel_m_s2: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    image_exposure_s: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    image_gain: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))


def stamps(rate_hz: float, seconds: float, jitter_ns: int = 0, offset_ns: int = 0) -> npt.NDArray[np.int64]:
    """Regular stamps with some jitter."""
    random = np.random.default_rng(SEED)
    regular = np.rint(np.arange(int(seconds * rate_hz)) * 1e9 / rate_hz).astype(np.int64)
    return START_NS + offset_ns + regular + random.integers(-jitter_ns, jitter_ns + 1, len(regular))


def made_up_flight(seconds: float = 2.0, imu_hz: float = 250.0) -> MadeUpFlight:
    """A flight without images."""
    random = np.random.default_rng(SEED)
    imu_t_ns = stamps(imu_hz, seconds, jitter_ns=50_000)
    range_t_ns = stamps(25.0, seconds, jitter_ns=1_000_000, offset_ns=20_000_000)
    truth_t_ns = stamps(250.0, seconds)
    quaternions = random.normal(size=(len(truth_t_ns), 4))
    return MadeUpFlight(
        imu_t_ns=imu_t_ns,
        imu_gyro_rad_s=random.normal(scale=1.0, size=(len(imu_t_ns), 3)),
        imu_accel_m_s2=random.normal(scale=10.0, size=(len(imu_t_ns), 3)),
        range_t_ns=range_t_ns,
        range_m=random.uniform(0.1, 39.9, size=len(range_t_ns)),
        truth_t_ns=truth_t_ns,
        truth_p_m=random.normal(size=(len(truth_t_ns), 3)),
        truth_q_wxyz=quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True),
        truth_v_m_s=random.normal(size=(len(truth_t_ns), 3)),
    )


def write_images(folder: Path, seconds: float) -> list[tuple[int, Path]]:
    """Images of noise at 20 Hz."""
    random = np.random.default_rng(SEED)
    images = []
    for t_ns in stamps(20.0, seconds, offset_ns=7_000_001).tolist():
        path = folder / f"{t_ns}.png"
        Image.fromarray(random.integers(0, 256, (HEIGHT, WIDTH), dtype=np.uint8)).save(path)
        images.append((t_ns, path))
    return images
