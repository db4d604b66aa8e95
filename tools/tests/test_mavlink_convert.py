"""Plumb's state in MAVLink's frames: the same vectors, turns and ellipsoids, by another way of computing them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink
from scipy.spatial.transform import Rotation

from mavlink_flight import PERIOD_NS, START_NS, output, random_covariance, state
from plumb_tools.mavlink import frames
from plumb_tools.mavlink.convert import MAX_STATE_AGE_NS, SETTLING_NS, Converter, Options, quality
from plumb_tools.report.run import Mode
from plumb_tools.message_types import types
from plumb_tools.trajectory import FloatArray

SEED = 20261126
UPPER = [(i, j) for i in range(6) for j in range(i, 6)]
AXES = ("FLU", "FRD", "UFL", "BRU", "DLF")


def _decoded(message: Any) -> Any:
    """As it is after the wire: MAVLink's numbers are floats of 32 bits."""
    line = mavlink.MAVLink(None, srcSystem=1, srcComponent=197)
    return mavlink.MAVLink(None).parse_buffer(message.pack(line))[0]


def _converted(converter: Converter, *events: tuple[str, bytes]) -> list[Any]:
    return [_decoded(message) for event in events for message in converter.take(*event)]


def _symmetric(upper: list[float]) -> FloatArray:
    whole = np.zeros((6, 6))
    for (i, j), value in zip(UPPER, upper, strict=True):
        whole[i, j] = whole[j, i] = value
    return whole


def _imu_axes_in_body(axes: str) -> FloatArray:
    """What the letters mean, told once more: forward and back along x, right and left along y, down and up along z."""
    return np.array([[(a == "F") - (a == "B"), (a == "R") - (a == "L"), (a == "D") - (a == "U")] for a in axes]).T


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("north", [False, True])
def test_position_velocity_and_attitude_are_the_same_in_other_frames(axes: str, north: bool) -> None:
    """Every vector is looked at in the frame it is told in."""
    random = np.random.default_rng(SEED)
    for _ in range(20):
        p, v = random.normal(scale=30.0, size=3), random.normal(scale=5.0, size=3)
        q_WI = Rotation.random(rng=random)
        converter = Converter(Options(r_BI=frames.body_from_imu(axes)))
        events = state(START_NS, np.eye(15), heading_known=north), output(START_NS, p, v, q_WI)
        (odometry,) = _converted(converter, *events)
        ahead, right, up = (p[1], p[0], p[2]) if north else (p[0], -p[1], p[2])
        np.testing.assert_allclose([odometry.x, odometry.y, odometry.z], [ahead, right, -up], rtol=1e-6, atol=1e-5)
        # The velocity in W, to I, and to B by what the letters say of the axes of I.
        v_B = _imu_axes_in_body(axes) @ q_WI.inv().apply(v)
        np.testing.assert_allclose([odometry.vx, odometry.vy, odometry.vz], v_B, atol=1e-5)
        # The body's axes, by the quaternion, point where the IMU's do in W.
        q_LB = Rotation.from_quat(odometry.q, scalar_first=True)
        assert odometry.q[0] >= 0.0
        for axis in np.eye(3):
            x, y, z = q_WI.apply(axis)
            expected = (y, x, -z) if north else (x, -y, -z)
            np.testing.assert_allclose(q_LB.apply(_imu_axes_in_body(axes) @ axis), expected, atol=1e-6)
        assert (odometry.frame_id, odometry.child_frame_id) == (mavlink.MAV_FRAME_LOCAL_FRD, mavlink.MAV_FRAME_BODY_FRD)
        assert odometry.estimator_type == mavlink.MAV_ESTIMATOR_TYPE_VIO
        assert all(math.isnan(rate) for rate in (odometry.rollspeed, odometry.pitchspeed, odometry.yawspeed))


def test_a_tilted_imu_flies_level() -> None:
    """Pitched up by ten degrees on the airframe, it is pitched up by ten degrees in level flight to the east."""
    r_BI = frames.body_from_imu("FLU", (0.0, 10.0, 0.0))
    q_WI = Rotation.from_euler("y", -10.0, degrees=True)  # about an axis to the left, nose up is negative
    events = state(START_NS, np.eye(15)), output(START_NS, v=np.array([8.0, 0.0, 0.0]), q=q_WI)
    (odometry,) = _converted(Converter(Options(r_BI=r_BI)), *events)
    np.testing.assert_allclose(odometry.q, (1, 0, 0, 0), atol=1e-6)
    np.testing.assert_allclose((odometry.vx, odometry.vy, odometry.vz), (8, 0, 0), atol=1e-6)


def test_an_ellipsoid_of_position_lies_as_it_did() -> None:
    """Long to the north-west and up: in FRD its axes are the same directions in other numbers."""
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8])
    sigmas = np.array([5.0, 0.5, 0.1])
    covariance = np.zeros((15, 15))
    covariance[:3, :3] = turn.as_matrix() @ np.diag(sigmas**2) @ turn.as_matrix().T
    (odometry,) = _converted(Converter(Options()), state(START_NS, covariance), output(START_NS))
    variances, axes = np.linalg.eigh(_symmetric(odometry.pose_covariance)[:3, :3])
    np.testing.assert_allclose(np.sqrt(variances), sorted(sigmas), rtol=1e-3)
    longest = turn.apply([1.0, 0.0, 0.0]) * [1.0, -1.0, -1.0]
    assert abs(axes[:, 2] @ longest) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("north", [False, True])
def test_covariances_are_those_of_drawn_errors(north: bool) -> None:
    """Errors are drawn in Plumb's terms, and each erring state is told in MAVLink's."""
    random = np.random.default_rng(SEED)
    covariance = 1e-6 * random_covariance(random)
    q_WI, v_W = Rotation.random(rng=random), np.array([8.0, -3.0, 1.0])
    options = Options(r_BI=frames.body_from_imu("UFL"))
    events = state(START_NS, covariance, q_WI=q_WI.as_quat(scalar_first=True).tolist(), heading_known=north)
    (odometry,) = _converted(Converter(options), events, output(START_NS, v=v_W, q=q_WI))

    drawn = random.multivariate_normal(np.zeros(15), covariance, size=40_000)
    turned = q_WI * Rotation.from_rotvec(drawn[:, 6:9])
    r_LW = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]] if north else np.diag([1, -1, -1]))
    local_turns = (r_LW * turned * (r_LW * q_WI).inv()).as_rotvec()
    pose = np.hstack([r_LW.apply(drawn[:, :3]), local_turns])
    velocity = turned.inv().apply(v_W + drawn[:, 3:6]) @ _imu_axes_in_body("UFL").T

    for told, errors in ((odometry.pose_covariance, pose), (odometry.velocity_covariance, velocity)):
        expected = np.cov(errors.T)
        size = len(expected)
        scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        assert np.max(np.abs(_symmetric(told)[:size, :size] - expected) / scale) < 0.03
    assert np.all(np.isnan(_symmetric(odometry.velocity_covariance)[3:, :]))


def test_diagonals_stand_where_autopilots_look_for_them() -> None:
    covariance = np.diag(np.arange(1.0, 16.0))
    (odometry,) = _converted(Converter(Options()), state(START_NS, covariance), output(START_NS))
    assert [odometry.pose_covariance[i] for i in (0, 6, 11, 15, 18, 20)] == [1, 2, 3, 7, 8, 9]
    assert [odometry.velocity_covariance[i] for i in (0, 6, 11)] == [4, 5, 6]


def test_north_is_said_only_where_it_is_known_and_wanted() -> None:
    for wanted in (False, True):
        for known in (False, True):
            events = state(START_NS, np.eye(15), heading_known=known), output(START_NS)
            (odometry,) = _converted(Converter(Options(say_north=wanted)), *events)
            is_ned = odometry.frame_id == mavlink.MAV_FRAME_LOCAL_NED
            assert is_ned == (wanted and known)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"mode": Mode.RANGE_VIO}, 100),
        ({"mode": Mode.VIO}, 60),
        ({"mode": Mode.INERTIAL}, 10),
        ({"mode": Mode.INITIALISING}, None),
        ({"mode": Mode.RANGE_VIO, "valid": False}, None),
        ({"mode": 77}, None),
    ],
)
def test_quality_and_silence(values: dict[str, Any], expected: int | None) -> None:
    told = output(START_NS, **values)
    assert quality(types().nav_output_t.decode(told[1])) == expected
    sent = _converted(Converter(Options()), state(START_NS, np.eye(15)), told)
    assert [odometry.quality for odometry in sent] == ([] if expected is None else [expected])


def _counter_after(converter: Converter, t_ns: int, **values: Any) -> int:
    """The reset counter of the first message after a state, which comes once the outputs have settled."""
    assert not _converted(converter, state(t_ns, np.eye(15), **values), output(t_ns + SETTLING_NS - 1))
    (odometry,) = _converted(converter, output(t_ns + SETTLING_NS))
    return int(odometry.reset_counter)


def test_the_reset_counter_wraps() -> None:
    converter = Converter(Options())
    assert _converted(converter, state(START_NS, np.eye(15), reset_count=254), output(START_NS))[0].reset_counter == 254
    after = [_counter_after(converter, START_NS + i * 10**9, reset_count=254 + i) for i in range(1, 5)]
    assert after == [255, 0, 1, 2]


def test_a_turn_to_the_north_is_a_reset_and_so_is_losing_it() -> None:
    """By a re-initialisation, which forgets the heading: both numbers change, and it is one reset."""
    converter = Converter(Options())
    assert _converted(converter, state(START_NS, np.eye(15)), output(START_NS))[0].reset_counter == 0
    assert _counter_after(converter, START_NS + 10**9, heading_known=True) == 1
    assert _counter_after(converter, START_NS + 2 * 10**9, reset_count=1) == 2


@pytest.mark.parametrize(("rate_hz", "expected"), [(50.0, 50), (30.0, 30), (1000.0, 250), (7.0, 7)])
def test_outputs_are_thinned_to_the_rate(rate_hz: float, expected: int) -> None:
    converter = Converter(Options(rate_hz=rate_hz))
    sent = []
    for i in range(500):
        t_ns = START_NS + i * PERIOD_NS
        sent += _converted(converter, *([state(t_ns, np.eye(15))] if i % 8 == 0 else []), output(t_ns))
    stamps = [odometry.time_usec for odometry in sent]
    assert abs(len(sent) - 2 * expected) <= 1
    assert stamps[0] == START_NS // 1000 and np.all(np.diff(stamps) > 0)
    assert np.max(np.diff(stamps)) <= 1e6 / rate_hz + PERIOD_NS / 1000


def test_what_cannot_be_sent_is_counted() -> None:
    converter = Converter(Options())
    before = [output(START_NS), ("NAV_STATE", b"rubbish"), ("NAV_OUTPUT", output(START_NS)[1][:20]), ("TIMING", b"")]
    after = [
        output(START_NS + 4, p=np.array([np.nan, 0.0, 0.0])),
        output(START_NS + 3),
        output(START_NS + MAX_STATE_AGE_NS + 9),
    ]
    assert not _converted(converter, *before)
    assert not _converted(converter, state(START_NS + 1, np.eye(15)), *after)
    assert converter.counts == {"no state": 1, "undecodable": 2, "not finite": 1, "out of order": 1, "state too old": 1}
    # Another flight, whose clock began anew.
    assert _converted(converter, state(17, np.eye(15)), output(18 + 10**6))


def test_ranges_from_frames_and_from_states() -> None:
    converter = Converter(Options(range_limits_m=(0.2, 30.0), range_noise_m=0.05))
    (from_state,) = _converted(converter, state(2_000_000_000, np.eye(15), range_measured_m=12.345))
    assert (from_state.time_boot_ms, from_state.current_distance, from_state.signal_quality) == (2000, 1234, 100)
    assert (from_state.min_distance, from_state.max_distance, from_state.covariance) == (20, 3000, 25)
    assert from_state.orientation == mavlink.MAV_SENSOR_ROTATION_PITCH_270
    frame = types().input_frame_t()
    frame.range_count = 3
    for sample, (t_ms, range_m, how) in zip(frame.range, ((2**32 + 7, 1.0, 0), (8, 0.0, 1), (9, 2.5, 2)), strict=False):
        sample.time_ns, sample.range_m, sample.quality = t_ms * 1_000_000, range_m, how
    sent = _converted(converter, ("INPUT_FRAME", frame.encode()))
    told = [(one.time_boot_ms, one.current_distance, one.signal_quality) for one in sent]
    assert told == [(7, 100, 100), (8, 3001, 1), (9, 250, 1)]
    # The states of the same stream tell the same ranges once more.
    assert not _converted(converter, state(2_100_000_000, np.eye(15), range_measured_m=12.0))


@pytest.mark.parametrize("axes", ["FRU", "FFU", "FL", "XYZ", ""])
def test_axes_that_make_no_frame(axes: str) -> None:
    with pytest.raises(ValueError, match="^" + axes + "$"):
        frames.body_from_imu(axes)
