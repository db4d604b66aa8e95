"""The true motion of a flight, exact at any time: nothing is integrated or differentiated numerically.

Position and yaw are sums of elementary terms whose derivatives are known. The attitude leans into the acceleration as a
multirotor's does, so its rate follows from the third derivative of the position.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from plumb_tools.sim import jets
from plumb_tools.sim.scene import Gusts, Hold, Move, Path, Scene, Segment, Sway, Turn, Velocity
from plumb_tools.sim.streams import stream
from plumb_tools.trajectory import FloatArray

#: Share of a sway's time at each end in which it swells up and fades out.
_SWAY_BLEND = 0.2

_GUST_SINES = 16


@dataclass(frozen=True)
class Motion:
    """Motion of I in W at N instants."""

    p_WI_m: FloatArray  #: (N, 3)
    v_WI_m_s: FloatArray  #: (N, 3)
    a_WI_m_s2: FloatArray  #: (N, 3) coordinate acceleration, without gravity
    q_WI: FloatArray  #: (N, 4) w x y z, Hamilton, from I to W
    R_WI: FloatArray  #: (N, 3, 3) the same as matrices
    omega_I_rad_s: FloatArray  #: (N, 3) rate of I with respect to W, in I


@dataclass(frozen=True)
class _Term:
    """`amount` (x, y, z in m; yaw in rad) times a jet."""

    amount: FloatArray
    jet: Callable[[FloatArray], FloatArray]


def _sum_of_sines(rms: float, band: tuple[float, float], phases: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Displacement whose velocity has this rms, with the spectrum of turbulence: amplitude of velocity f**-5/6."""
    frequencies = np.geomspace(band[0], band[1], len(phases))
    weight = frequencies ** (-5.0 / 6.0)
    speed = rms * np.sqrt(2.0) * weight / np.linalg.norm(weight)
    amplitude = speed / (2.0 * np.pi * frequencies)

    def jet(t_s: FloatArray) -> FloatArray:
        waves = [a * jets.sine(t_s, float(f), float(p)) for a, f, p in zip(amplitude, frequencies, phases, strict=True)]
        return np.asarray(np.sum(waves, axis=0))

    return jet


class Trajectory:
    """The motion of one flight. Times are seconds after the flight's start; it may be asked about any."""

    def __init__(self, path: Path, gravity_m_s2: float, seed: int) -> None:
        """Lays out the segments one after another; gusts are drawn from the seed."""
        self.length_s = path.length_s
        self._start = np.array([*path.start.position_m, np.radians(path.start.yaw_deg)])
        self._velocity = np.array([*path.start.velocity_m_s, 0.0])
        self._lean = path.lean
        self._gravity_m_s2 = gravity_m_s2
        self._terms: list[_Term] = []
        t_s, velocity = 0.0, self._velocity
        for segment in path.segments:
            velocity = self._add(segment, t_s, velocity)
            t_s += segment.duration_s
        self._add_gusts(path.gusts, seed)

    @classmethod
    def of(cls, scene: Scene, seed: int) -> Trajectory:
        """The trajectory of a scene."""
        return cls(scene.trajectory, scene.scene.gravity_m_s2, seed)

    def _add(self, segment: Segment, t_s: float, velocity: FloatArray) -> FloatArray:
        """Adds the terms of a segment; returns the velocity after it."""
        duration = segment.duration_s

        def step(t: FloatArray) -> FloatArray:
            return jets.stretched(jets.step((t - t_s) / duration), duration)

        def ramp(t: FloatArray) -> FloatArray:
            return duration * jets.stretched(jets.ramp((t - t_s) / duration), duration)

        match segment:
            case Move():
                self._terms.append(_Term(np.array([*segment.by_m, np.radians(segment.yaw_deg)]), step))
            case Velocity():
                target = np.array([*segment.to_m_s, 0.0])
                self._terms.append(_Term(target - velocity, ramp))
                return target
            case Turn():
                angle = np.radians(segment.by_deg)
                c, s = np.cos(angle), np.sin(angle)
                x, y, z, yaw = velocity
                target = np.array([c * x - s * y, s * x + c * y, z, yaw])
                self._terms.append(_Term(target - velocity, ramp))
                self._terms.append(_Term(np.array([0.0, 0.0, 0.0, angle]), step))
                return target
            case Sway():
                self._add_sway(segment, t_s)
            case Hold():
                pass
        return velocity

    def _add_sway(self, segment: Sway, t_s: float) -> None:
        end_s, blend_s = t_s + segment.duration_s, _SWAY_BLEND * segment.duration_s
        amounts = [*segment.amplitude_m, np.radians(segment.yaw_deg)]
        frequencies = [*segment.frequency_hz, segment.yaw_frequency_hz]
        for axis, (amount, frequency) in enumerate(zip(amounts, frequencies, strict=True)):

            def jet(t: FloatArray, frequency: float = frequency, axis: int = axis) -> FloatArray:
                wave = jets.sine(t - t_s, frequency, 0.7 * axis)
                return jets.product(jets.window(t, t_s, end_s, blend_s), wave)

            self._terms.append(_Term(amount * np.eye(4)[axis], jet))

    def _add_gusts(self, gusts: Gusts, seed: int) -> None:
        phases = stream(seed, "gusts").uniform(0.0, 2.0 * np.pi, (4, _GUST_SINES))
        middle = float(np.sqrt(gusts.band_hz[0] * gusts.band_hz[1]))
        rms = [*gusts.velocity_rms_m_s, np.radians(gusts.yaw_rms_deg) * 2.0 * np.pi * middle]
        for axis in range(4):
            if rms[axis] == 0.0:
                continue
            waves = _sum_of_sines(float(rms[axis]), (gusts.band_hz[0], gusts.band_hz[1]), phases[axis])

            def jet(t: FloatArray, waves: Callable[[FloatArray], FloatArray] = waves) -> FloatArray:
                swell = jets.stretched(jets.step((t - gusts.start_s) / gusts.swell_s), gusts.swell_s)
                return jets.product(swell, waves(t))

            self._terms.append(_Term(np.eye(4)[axis], jet))

    def at(self, t_s: FloatArray) -> Motion:
        """The motion at instants (N,)."""
        t = np.atleast_1d(np.asarray(t_s, np.float64))
        total = np.zeros((4, len(t), 4))
        total[0] = self._start + t[:, None] * self._velocity
        total[1] = self._velocity
        for term in self._terms:
            total += term.jet(t)[:, :, None] * term.amount
        thrust = self._lean * total[2, :, :3] + np.array([0.0, 0.0, self._gravity_m_s2])
        q, omega = _attitude(thrust, self._lean * total[3, :, :3], total[0, :, 3], total[1, :, 3])
        return Motion(total[0, :, :3], total[1, :, :3], total[2, :, :3], q, matrices(q), omega)


def _attitude(
    thrust: FloatArray, thrust_rate: FloatArray, yaw: FloatArray, yaw_rate: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Attitude whose z axis is the shortest turn away from the vertical to `thrust`, then turned by yaw about that
    axis; the rate follows from the derivative of the unnormalised quaternion (1 + z, -y, x, 0).
    """
    norm = np.linalg.norm(thrust, axis=1, keepdims=True)
    z = thrust / norm
    z_rate = (thrust_rate - z * np.sum(z * thrust_rate, axis=1, keepdims=True)) / norm
    zero = np.zeros(len(z))
    tilt = np.column_stack([1.0 + z[:, 2], -z[:, 1], z[:, 0], zero])
    tilt_rate = np.column_stack([z_rate[:, 2], -z_rate[:, 1], z_rate[:, 0], zero])
    conjugate = tilt * np.array([1.0, -1.0, -1.0, -1.0])
    squared = np.sum(tilt**2, axis=1, keepdims=True)
    omega_tilt = 2.0 / squared * quaternion_product(conjugate, tilt_rate)[:, 1:]
    heading = np.column_stack([np.cos(0.5 * yaw), zero, zero, np.sin(0.5 * yaw)])
    omega = np.einsum("nji,nj->ni", matrices(heading), omega_tilt)
    omega[:, 2] += yaw_rate
    return quaternion_product(tilt / np.sqrt(squared), heading), omega


def quaternion_product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Hamilton product of quaternions (N, 4), w first."""
    w = a[:, :1] * b[:, :1] - np.sum(a[:, 1:] * b[:, 1:], axis=1, keepdims=True)
    v = a[:, :1] * b[:, 1:] + b[:, :1] * a[:, 1:] + np.cross(a[:, 1:], b[:, 1:])
    return np.hstack([w, v])


def matrices(q: FloatArray) -> FloatArray:
    """Rotation matrices (N, 3, 3) of unit quaternions (N, 4), w first."""
    w, x, y, z = q.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)
