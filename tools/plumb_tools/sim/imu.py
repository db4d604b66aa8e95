"""What the IMU says about the true motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plumb_tools.sim.clock import Instants
from plumb_tools.sim.flight import ImuData
from plumb_tools.sim.motion import Motion
from plumb_tools.sim.sensors import Imu
from plumb_tools.sim.streams import Generator, stream
from plumb_tools.trajectory import FloatArray

_AXES = 3


@dataclass(frozen=True)
class ImuRecord:
    """Samples and the biases that were in them."""

    data: ImuData
    gyro_bias_rad_s: FloatArray  #: (N, 3)
    accel_bias_m_s2: FloatArray  #: (N, 3)


@dataclass(frozen=True)
class _Triad:
    """Errors of three gyros or three accelerometers."""

    name: str
    noise_density: float
    bias_walk: float
    turn_on: float
    scale_ppm: float
    misalignment_rad: float
    limit: float
    narrow: float
    broad: float


def _triads(imu: Imu) -> tuple[_Triad, _Triad]:
    shake = imu.vibration
    gyro = _Triad(
        "gyro",
        imu.gyro_noise_density,
        imu.gyro_bias_walk,
        imu.gyro_turn_on_rad_s,
        imu.gyro_scale_ppm,
        imu.gyro_misalignment_rad,
        imu.gyro_range_rad_s,
        shake.gyro_narrow_rad_s,
        shake.gyro_broad_rad_s,
    )
    accel = _Triad(
        "accel",
        imu.accel_noise_density,
        imu.accel_bias_walk,
        imu.accel_turn_on_m_s2,
        imu.accel_scale_ppm,
        imu.accel_misalignment_rad,
        imu.accel_range_m_s2,
        shake.accel_narrow_m_s2,
        shake.accel_broad_m_s2,
    )
    return gyro, accel


def _distortion(triad: _Triad, random: Generator) -> FloatArray:
    """Scale errors, and sensitive axes that are a little off: a matrix near one."""
    scale = np.diag(1e-6 * triad.scale_ppm * random.standard_normal(_AXES))
    cross = triad.misalignment_rad * random.standard_normal((_AXES, _AXES))
    return np.eye(_AXES) + scale + cross - np.diag(np.diag(cross))


def _vibration(imu: Imu, triad: _Triad, t_s: FloatArray, seed: int) -> FloatArray:
    """A tone that wanders in frequency, its phase different on each axis, and broadband noise; both from the rotors."""
    random = stream(seed, f"imu.{triad.name}.vibration")
    shake = imu.vibration
    wander = np.cumsum(random.standard_normal(len(t_s))) / imu.rate_hz**0.5
    wander -= np.linspace(0.0, 1.0, len(t_s)) * wander[-1]
    frequency = shake.frequency_hz + shake.wander_hz * wander / max(float(np.std(wander)), 1e-9)
    phase = 2.0 * np.pi * np.cumsum(frequency) / imu.rate_hz
    swing = random.uniform(0.5, 1.0, _AXES) * triad.narrow
    tone = swing * np.sin(phase[:, None] + random.uniform(0.0, 2.0 * np.pi, _AXES))
    noise = triad.broad * random.standard_normal((len(t_s), _AXES))
    turning = np.clip(t_s - shake.start_s, 0.0, 1.0)
    return turning[:, None] * (tone + noise)


def _measured(imu: Imu, triad: _Triad, true: FloatArray, t_s: FloatArray, seed: int) -> tuple[FloatArray, FloatArray]:
    """Samples and biases. Density d: white noise has d sqrt(rate) per sample, a walk steps by d / sqrt(rate)."""
    if imu.ideal:
        return true, np.zeros_like(true)
    root_rate = np.sqrt(imu.rate_hz)
    turn_on = triad.turn_on * stream(seed, f"imu.{triad.name}.turn_on").standard_normal(_AXES)
    steps = stream(seed, f"imu.{triad.name}.walk").standard_normal(true.shape)
    bias = turn_on + triad.bias_walk / root_rate * np.cumsum(steps, axis=0)
    noise = triad.noise_density * root_rate * stream(seed, f"imu.{triad.name}.noise").standard_normal(true.shape)
    skewed = true @ _distortion(triad, stream(seed, f"imu.{triad.name}.axes")).T
    values = skewed + bias + noise + _vibration(imu, triad, t_s, seed)
    return np.clip(values, -triad.limit, triad.limit), bias


def sample(imu: Imu, motion: Motion, instants: Instants, gravity_m_s2: float, seed: int) -> ImuRecord:
    """The IMU on a motion sampled at the same instants."""
    gyro, accel = _triads(imu)
    force_W = motion.a_WI_m_s2 + np.array([0.0, 0.0, gravity_m_s2])
    force_I = np.einsum("nji,nj->ni", motion.R_WI, force_W)
    rates, gyro_bias = _measured(imu, gyro, motion.omega_I_rad_s, instants.t_s, seed)
    forces, accel_bias = _measured(imu, accel, force_I, instants.t_s, seed)
    return ImuRecord(ImuData(instants.stamp_ns, rates, forces), gyro_bias, accel_bias)


def effective_densities(imu: Imu) -> tuple[float, float]:
    """Noise densities of gyro and accelerometer with the rotors' broadband part in: what a calibration in hover finds,
    and what a filter should be told. Those of the data sheet for an ideal IMU: no filter can be told none.
    """
    per_root_hz = 0.0 if imu.ideal else 1.0 / np.sqrt(imu.rate_hz)
    return (
        float(np.hypot(imu.gyro_noise_density, imu.vibration.gyro_broad_rad_s * per_root_hz)),
        float(np.hypot(imu.accel_noise_density, imu.vibration.accel_broad_m_s2 * per_root_hz)),
    )


def effective_biases(imu: Imu, gravity_m_s2: float) -> tuple[float, float]:
    """Standard deviations of the biases of gyro and accelerometer at turn-on, per axis, as a data sheet's repeatability
    and misalignment give them: on a level vehicle gravity shows on the axes that lean, like a bias. Never zero: no
    filter can be told none.
    """
    least = 1e-6
    accel = float(np.hypot(imu.accel_turn_on_m_s2, imu.accel_misalignment_rad * gravity_m_s2))
    return max(imu.gyro_turn_on_rad_s, least), max(accel, least)
