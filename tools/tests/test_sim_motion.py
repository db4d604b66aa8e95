"""The trajectory is exact: what an ideal IMU feels leads back to it, and its derivatives are derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from plumb_tools.sim import clock, imu, scene_file
from plumb_tools.sim.motion import Motion, Trajectory
from plumb_tools.sim.scene import Scene
from plumb_tools.sim.sensors import Imu, ImuClock
from plumb_tools.trajectory import FloatArray
from scipy.spatial.transform import Rotation

FLIGHT_S = 60.0


def _rotation_vector(w0: FloatArray, w1: FloatArray, w2: FloatArray, h: float, share: float) -> FloatArray:
    """Rotation over the first `share` of an interval with rates at start, middle and end (Magnus, fourth order)."""
    slope = (-3.0 * w0 + 4.0 * w1 - w2) / h
    curve = 2.0 * (w0 - 2.0 * w1 + w2) / h**2
    s = share * h
    turned = w0 * s + slope * s**2 / 2.0 + curve * s**3 / 3.0
    return np.asarray(turned + s**3 / 12.0 * np.cross(w0, slope))


def _integrated(data: imu.ImuData, start: Motion, gravity_m_s2: float) -> tuple[FloatArray, Rotation]:
    """Position (M, 3) and attitude at every second sample, by strapdown integration over pairs of samples."""
    t = (data.t_ns - data.t_ns[0]) * 1e-9
    position, velocity = start.p_WI_m[0], start.v_WI_m_s[0]
    attitude = Rotation.from_quat(start.q_WI[0], scalar_first=True)
    gravity = np.array([0.0, 0.0, -gravity_m_s2])
    positions, attitudes = [position], [attitude]
    for k in range(0, len(t) - 2, 2):
        h = float(t[k + 2] - t[k])
        w0, w1, w2 = data.gyro_rad_s[k : k + 3]
        a0 = attitude.apply(data.accel_m_s2[k]) + gravity
        half = attitude * Rotation.from_rotvec(_rotation_vector(w0, w1, w2, h, 0.5))
        a1 = half.apply(data.accel_m_s2[k + 1]) + gravity
        attitude = attitude * Rotation.from_rotvec(_rotation_vector(w0, w1, w2, h, 1.0))
        a2 = attitude.apply(data.accel_m_s2[k + 2]) + gravity
        position = position + h * velocity + h * h / 6.0 * (a0 + 2.0 * a1)
        velocity = velocity + h / 6.0 * (a0 + 4.0 * a1 + a2)
        positions.append(position)
        attitudes.append(attitude)
    return np.array(positions), Rotation.concatenate(attitudes)


def _scene(name: str) -> Scene:
    return scene_file.read(scene_file.find(name))


@pytest.mark.parametrize("name", ["excitation", "outdoor", "mars", "long"])
def test_an_ideal_imu_leads_back_to_the_trajectory(name: str) -> None:
    scene = _scene(name)
    trajectory = Trajectory.of(scene, seed=3)
    sensor = Imu(ideal=True, clock=ImuClock(jitter_s=0.0))
    instants = clock.instants("imu", sensor.clock, sensor.rate_hz, FLIGHT_S, 3)
    motion = trajectory.at(instants.t_s)
    gravity = scene.scene.gravity_m_s2
    record = imu.sample(sensor, motion, instants, gravity, 3)
    positions, attitudes = _integrated(record.data, motion, gravity)
    assert len(positions) > FLIGHT_S * 100
    assert np.linalg.norm(positions - motion.p_WI_m[::2], axis=1).max() < 1e-3
    true = Rotation.from_quat(motion.q_WI[::2], scalar_first=True)
    assert (true.inv() * attitudes).magnitude().max() < 1e-5


@pytest.mark.parametrize("name", scene_file.names())
def test_derivatives_are_derivatives(name: str) -> None:
    trajectory = Trajectory.of(_scene(name), seed=1)
    h = 1e-4
    t = np.linspace(0.01, trajectory.length_s - 0.01, 400)
    before, now, after = (trajectory.at(t + shift) for shift in (-h, 0.0, h))
    assert np.abs((after.p_WI_m - before.p_WI_m) / (2 * h) - now.v_WI_m_s).max() < 1e-6
    assert np.abs((after.v_WI_m_s - before.v_WI_m_s) / (2 * h) - now.a_WI_m_s2).max() < 1e-5
    turned = np.swapaxes(before.R_WI, 1, 2) @ after.R_WI
    assert np.abs(Rotation.from_matrix(turned).as_rotvec() / (2 * h) - now.omega_I_rad_s).max() < 1e-5
    assert np.abs(np.linalg.norm(now.q_WI, axis=1) - 1.0).max() < 1e-12


def test_nothing_excites_the_cruise() -> None:
    motion = Trajectory.of(_scene("cruise"), seed=5).at(np.linspace(0.0, 75.0, 500))
    assert np.abs(motion.a_WI_m_s2).max() == 0.0
    assert np.abs(motion.omega_I_rad_s).max() == 0.0
    assert np.allclose(motion.v_WI_m_s, [2.0, 0.0, 0.0], atol=0.0)


def test_gusts_have_the_speed_asked_for() -> None:
    scene = _scene("outdoor")
    motion = Trajectory.of(scene, seed=2).at(np.arange(20.0, 90.0, 0.05))
    expected = scene.trajectory.gusts.velocity_rms_m_s
    assert motion.v_WI_m_s[:, 1].std() == pytest.approx(expected[1], rel=0.4)
    assert (motion.v_WI_m_s[:, 0] - 2.0).std() == pytest.approx(expected[0], rel=0.4)


def test_imu_noise_has_the_densities_told_to_the_filter() -> None:
    sensor = Imu()
    instants = clock.instants("imu", sensor.clock, sensor.rate_hz, 200.0, 0)
    still = Trajectory.of(_scene("cruise"), seed=0).at(instants.t_s)
    record = imu.sample(sensor, still, instants, 9.80665, 0)
    gyro, accel = imu.effective_densities(sensor)
    airborne = instants.t_s > sensor.vibration.start_s + 1.0
    # Blocks of 0.2 s average the rotor tone away and leave the white noise.
    for values, density in ((record.data.gyro_rad_s, gyro), (record.data.accel_m_s2, accel)):
        blocks = values[airborne][:49000].reshape(-1, 50, 3).mean(axis=1)
        sigma = np.diff(blocks, axis=0).std(axis=0) / np.sqrt(2.0)
        assert np.all(sigma < 2.0 * density / np.sqrt(0.2))
        assert np.all(sigma > 0.7 * density / np.sqrt(0.2))


def test_imu_saturates() -> None:
    sensor = Imu(accel_range_m_s2=5.0)
    instants = clock.instants("imu", sensor.clock, sensor.rate_hz, 1.0, 0)
    record = imu.sample(sensor, Trajectory.of(_scene("cruise"), 0).at(instants.t_s), instants, 9.80665, 0)
    assert np.abs(record.data.accel_m_s2).max() == 5.0
