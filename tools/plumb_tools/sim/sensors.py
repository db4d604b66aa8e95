"""Sections `sensors` and `faults` of a scene file: the instruments, their errors, and what goes wrong with them.

Defaults are the paper's instruments: STIM300, OV7251, Garmin LIDAR-Lite v3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from plumb_tools.sim.schema import Choice, Flag, Items, Real, Vector, Whole, key, section

RATE = Real("Hz", above=0.0, high=2000.0)
SHARE = Real("", low=0.0, high=1.0)
NOT_NEGATIVE = Real("", low=0.0, high=1e6)
LEVER = Vector(3, Real("m", low=-5.0, high=5.0))
SMALL_ANGLES = Vector(3, Real("deg", low=-45.0, high=45.0))


@dataclass(frozen=True, kw_only=True)
class Clock:
    """When a sensor samples and what its stamps say: stamp = sampling time + offset + jitter.

    `phase`, in periods, moves the samples, so that the sensors do not all sample at the same instant.
    """

    phase: float = key(SHARE, 0.0)
    offset_s: float = key(Real("s", low=-0.1, high=0.1), 0.0)
    jitter_s: float = key(Real("s", low=0.0, high=0.01), 0.0)


@dataclass(frozen=True, kw_only=True)
class CameraClock(Clock):
    """Images fall between IMU samples."""

    phase: float = key(SHARE, 0.41)
    jitter_s: float = key(Real("s", low=0.0, high=0.01), 5e-5)


@dataclass(frozen=True, kw_only=True)
class RangeClock(Clock):
    """Read over I2C by a polling thread: stamps are coarser than those of the others."""

    phase: float = key(SHARE, 0.18)
    jitter_s: float = key(Real("s", low=0.0, high=0.01), 5e-4)


@dataclass(frozen=True, kw_only=True)
class ImuClock(Clock):
    """Stamped at the arrival of the datagram."""

    jitter_s: float = key(Real("s", low=0.0, high=0.01), 1e-5)


@dataclass(frozen=True, kw_only=True)
class Vibration:
    """What the rotors do to the IMU once they turn: a narrow band about the blade frequency, and broadband noise."""

    accel_narrow_m_s2: float = key(Real("m/s^2", low=0.0, high=100.0), 0.5)
    gyro_narrow_rad_s: float = key(Real("rad/s", low=0.0, high=10.0), 0.004)
    frequency_hz: float = key(Real("Hz", above=0.0, high=1000.0), 87.0)
    wander_hz: float = key(Real("Hz", low=0.0, high=100.0), 2.0)
    accel_broad_m_s2: float = key(Real("m/s^2", low=0.0, high=100.0), 0.03)
    gyro_broad_rad_s: float = key(Real("rad/s", low=0.0, high=10.0), 3e-4)
    start_s: float = key(Real("s", low=0.0, high=3600.0), 2.0)


@dataclass(frozen=True, kw_only=True)
class Imu:
    """IMU of STIM300 class (datasheet: 0.15 deg/sqrt(h), 0.5 deg/h, 0.06 m/s/sqrt(h), 0.05 mg).

    Densities per sqrt(Hz). Turn-on biases, scale errors and misalignments are drawn per axis with these 1-sigma values.
    """

    ideal: bool = key(Flag(), False)
    rate_hz: float = key(RATE, 250.0)
    clock: ImuClock = section(ImuClock)
    gyro_noise_density: float = key(Real("rad/s/sqrt(Hz)", low=0.0, high=1.0), 4.4e-5)
    gyro_bias_walk: float = key(Real("rad/s^2/sqrt(Hz)", low=0.0, high=1.0), 2.5e-7)
    gyro_turn_on_rad_s: float = key(Real("rad/s", low=0.0, high=1.0), 4.8e-5)
    gyro_scale_ppm: float = key(Real("ppm", low=0.0, high=1e5), 300.0)
    gyro_misalignment_rad: float = key(Real("rad", low=0.0, high=0.1), 5e-4)
    gyro_range_rad_s: float = key(Real("rad/s", above=0.0, high=100.0), 6.98)
    accel_noise_density: float = key(Real("m/s^2/sqrt(Hz)", low=0.0, high=10.0), 1.0e-3)
    accel_bias_walk: float = key(Real("m/s^3/sqrt(Hz)", low=0.0, high=10.0), 5.0e-5)
    accel_turn_on_m_s2: float = key(Real("m/s^2", low=0.0, high=10.0), 7.4e-3)
    accel_scale_ppm: float = key(Real("ppm", low=0.0, high=1e5), 200.0)
    accel_misalignment_rad: float = key(Real("rad", low=0.0, high=0.1), 5e-4)
    accel_range_m_s2: float = key(Real("m/s^2", above=0.0, high=1000.0), 98.0)
    vibration: Vibration = section(Vibration)


@dataclass(frozen=True, kw_only=True)
class Lens:
    """Projection and distortion. Coefficients as in OpenCV: radial-tangential k1 k2 p1 p2, equidistant k1 to k4,
    fov w 0 0 0.
    """

    model: str = key(Choice(("none", "radial-tangential", "equidistant", "fov")), "radial-tangential")
    focal_px: tuple[float, float] = key(Vector(2, Real("px", above=10.0, high=10000.0)), (401.3, 400.6))
    center_px: tuple[float, float] = key(Vector(2, Real("px", low=0.0, high=4096.0)), (321.4, 238.2))
    coefficients: tuple[float, float, float, float] = key(
        Vector(4, Real("", low=-10.0, high=10.0)), (-0.11, 0.025, 3e-4, -2e-4)
    )
    vignetting: float = key(SHARE, 0.35)


@dataclass(frozen=True, kw_only=True)
class Exposure:
    """Automatic exposure: time first, then gain, both slow."""

    automatic: bool = key(Flag(), True)
    target: float = key(Real("", above=0.0, high=0.9), 0.42)
    time_s: tuple[float, float] = key(Vector(2, Real("s", above=0.0, high=0.03), ascending=True), (5e-5, 4e-3))
    gain_max: float = key(Real("", low=1.0, high=64.0), 8.0)
    settling_s: float = key(Real("s", above=0.0, high=60.0), 0.4)


@dataclass(frozen=True, kw_only=True)
class Pixel:
    """From light to numbers: electrons at full scale and unit gain, per second at albedo 1 on a bright day."""

    full_well_e: float = key(Real("e-", above=0.0, high=1e6), 6500.0)
    electrons_per_s: float = key(Real("e-/s", above=0.0, high=1e12), 9e6)
    read_noise_e: float = key(Real("e-", low=0.0, high=1e4), 7.0)
    pattern_noise: float = key(Real("", low=0.0, high=0.2), 0.004)


@dataclass(frozen=True, kw_only=True)
class Camera:
    """Global-shutter grey camera that looks down, image up is forward. Rotations turn the camera about its own axes
    after that; `supersample` renders finer before the lens is applied, `blur_frames` averages over the exposure.
    """

    ideal: bool = key(Flag(), False)
    rate_hz: float = key(RATE, 30.0)
    clock: CameraClock = section(CameraClock)
    width_px: int = key(Whole(64, 4096), 640)
    height_px: int = key(Whole(48, 4096), 480)
    position_in_imu_m: tuple[float, float, float] = key(LEVER, (0.08, -0.03, -0.05))
    forward_tilt_deg: float = key(Real("deg", low=-30.0, high=90.0), 0.0)
    misalignment_deg: tuple[float, float, float] = key(SMALL_ANGLES, (1.5, -1.0, 2.0))
    lens: Lens = section(Lens)
    exposure: Exposure = section(Exposure)
    pixel: Pixel = section(Pixel)
    supersample: float = key(Real("", low=1.0, high=4.0), 1.1)
    blur_frames: int = key(Whole(1, 32), 1)


@dataclass(frozen=True, kw_only=True)
class RangeFinder:
    """Laser range finder beside the camera; `device` decides over which bus it is logged."""

    ideal: bool = key(Flag(), False)
    device: str = key(Choice(("lidar_lite", "can")), "lidar_lite")
    rate_hz: float = key(RATE, 25.0)
    clock: RangeClock = section(RangeClock)
    origin_in_cam_m: tuple[float, float, float] = key(LEVER, (0.04, 0.01, -0.005))
    tilt_deg: tuple[float, float] = key(Vector(2, Real("deg", low=-45.0, high=45.0)), (1.15, -0.86))
    min_range_m: float = key(Real("m", low=0.0, high=100.0), 0.05)
    max_range_m: float = key(Real("m", above=0.0, high=1000.0), 40.0)
    noise_m: float = key(Real("m", low=0.0, high=10.0), 0.025)
    quantisation_m: float = key(Real("m", low=0.0, high=1.0), 0.01)
    divergence_rad: float = key(Real("rad", low=0.0, high=0.1), 8e-3)
    returns: str = key(Choice(("first", "mean")), "mean")
    dropout: float = key(SHARE, 0.002)


@dataclass(frozen=True, kw_only=True)
class Sensors:
    """Section `sensors`."""

    imu: Imu = section(Imu)
    camera: Camera = section(Camera)
    lrf: RangeFinder = section(RangeFinder)


@dataclass(frozen=True, kw_only=True)
class Fault:
    """Something that goes wrong for a while."""

    TAG_KEY: ClassVar[str] = "kind"
    TAG: ClassVar[str] = ""
    start_s: float = key(Real("s", low=0.0, high=3600.0))
    duration_s: float = key(Real("s", above=0.0, high=3600.0))


@dataclass(frozen=True, kw_only=True)
class RangeOutage(Fault):
    """The range finder gets nothing back."""

    TAG = "range_outage"


@dataclass(frozen=True, kw_only=True)
class RangeOutliers(Fault):
    """Echoes from something in between: a share of the ranges is uniformly too short."""

    TAG = "range_outliers"
    share: float = key(SHARE, 0.1)


@dataclass(frozen=True, kw_only=True)
class CameraOutage(Fault):
    """No images arrive."""

    TAG = "camera_outage"


@dataclass(frozen=True, kw_only=True)
class CameraDark(Fault):
    """Images arrive, but no light reaches the sensor."""

    TAG = "camera_dark"


@dataclass(frozen=True, kw_only=True)
class ImuOutage(Fault):
    """No IMU samples arrive."""

    TAG = "imu_outage"


FAULTS = Items("kind", (RangeOutage, RangeOutliers, CameraOutage, CameraDark, ImuOutage))
