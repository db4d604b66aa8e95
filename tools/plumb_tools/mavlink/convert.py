"""Plumb's LCM messages to MAVLink's: no socket, no clock, so that a log and a flight are converted alike."""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink
from scipy.spatial.transform import Rotation

from plumb_tools.mavlink import frames
from plumb_tools.message_types import types
from plumb_tools.report.run import Mode
from plumb_tools.trajectory import NS_PER_S, FloatArray

#: An output is held back for so long after a state that begins anew: a result counts 32 ms after its image was handed
#: over (docs/executive.md), and outputs from before are in the old world.
SETTLING_NS = 100_000_000
#: A covariance older than that says nothing of now.
MAX_STATE_AGE_NS = 500_000_000
#: A stamp that lies further back than that is not late: another flight has begun.
RESTART_NS = NS_PER_S

QUALITY = {Mode.RANGE_VIO: 100, Mode.VIO: 60, Mode.INERTIAL: 10}

RANGE_VALID, RANGE_NO_RETURN = 0, 1
SIGNAL_PERFECT, SIGNAL_INVALID = 100, 1
_MAX_CM = 0xFFFF
_UNKNOWN_VARIANCE_CM2 = 255


def quality(told: Any) -> int | None:
    """MAVLink's quality, 1 to 100, of what a NAV_STATE or NAV_OUTPUT rests on; none where nothing is to be sent.

    Without a state there are no numbers to send, and the quality -1 that stands for it is newer than some autopilots:
    all understand silence.
    """
    return QUALITY.get(told.mode) if told.valid else None


@dataclass(frozen=True)
class Options:
    """How the vehicle is built and what its autopilot takes."""

    rate_hz: float = 50.0  #: of ODOMETRY
    r_BI: FloatArray = field(default_factory=lambda: frames.body_from_imu("FLU"))
    say_north: bool = False  #: frame LOCAL_NED once the heading is known, which PX4 takes and ArduPilot does not
    range_limits_m: tuple[float, float] = (0.1, 40.0)
    range_orientation: int = mavlink.MAV_SENSOR_ROTATION_PITCH_270  #: looks down
    range_noise_m: float = 0.0  #: 1 sigma; 0: not known


class Converter:
    """Takes messages in the order in which they come, and gives what is to be sent at once."""

    def __init__(self, options: Options) -> None:
        self._options = options
        self._state: Any = None
        self._resets = 0  #: of the newest state
        self._settled_ns: int | None = None  #: outputs from then on belong to the newest state
        self._due_ns: int | None = None
        self._newest_ns: int | None = None
        self._has_frames = False
        self.counts: Counter[str] = Counter()  #: messages made, and outputs not sent by reason
        self._takers: dict[str, tuple[str, Callable[[Any], Iterator[Any]]]] = {
            "NAV_STATE": ("nav_state_t", self._take_state),
            "NAV_OUTPUT": ("nav_output_t", self._take_output),
            "INPUT_FRAME": ("input_frame_t", self._take_frame),
        }

    @property
    def channels(self) -> tuple[str, ...]:
        """What it wants to be given."""
        return tuple(self._takers)

    @property
    def has_state(self) -> bool:
        """Whether there is something to navigate by."""
        return self._state is not None and quality(self._state) is not None

    def take(self, channel: str, data: bytes) -> list[Any]:
        """MAVLink messages that an LCM message gives rise to. One that cannot be decoded is counted."""
        if channel not in self._takers:
            return []
        name, taker = self._takers[channel]
        try:
            message = getattr(types(), name).decode(data)
        except (ValueError, struct.error):
            self.counts["undecodable"] += 1
            return []
        made = list(taker(message))
        self.counts.update(one.get_type() for one in made)
        return made

    def _take_state(self, state: Any) -> Iterator[Any]:
        old, self._state = self._state, state
        if old is None:
            self._resets = state.reset_count
        elif (old.reset_count, old.heading_known) != (state.reset_count, state.heading_known):
            # The world's turn to the north, once its heading is known, is a reset to an autopilot.
            self._resets += max(state.reset_count - old.reset_count, 1)
            self._settled_ns = state.time_ns + SETTLING_NS
        if not self._has_frames and state.range_measured_m > 0.0:
            # On the network there are no frames, and of the ranges of an image only the newest is told.
            yield self._distance(state.time_ns, state.range_measured_m, RANGE_VALID)

    def _take_frame(self, frame: Any) -> Iterator[Any]:
        self._has_frames = True
        for sample in frame.range[: frame.range_count]:
            yield self._distance(sample.time_ns, sample.range_m, sample.quality)

    def _take_output(self, output: Any) -> Iterator[Any]:
        reason = self._why_not(output)
        if reason is not None:
            self.counts[reason] += 1
        elif self._is_due(output.time_ns):
            yield self._odometry(output)

    def _why_not(self, output: Any) -> str | None:
        """Why an output is no good to send."""
        t_ns = output.time_ns
        if self._newest_ns is not None and self._newest_ns - RESTART_NS < t_ns <= self._newest_ns:
            return "out of order"
        if self._newest_ns is not None and t_ns <= self._newest_ns:
            self._due_ns = self._settled_ns = None
        self._newest_ns = t_ns
        if not np.all(np.isfinite([*output.p_WI_m, *output.v_WI_m_s, *output.q_WI])) or not any(output.q_WI):
            return "not finite"
        if not self.has_state or quality(output) is None:
            return "no state"
        if abs(t_ns - self._state.time_ns) > MAX_STATE_AGE_NS:
            return "state too old"
        if self._settled_ns is not None and t_ns < self._settled_ns:
            return "held back after a reset"
        return None

    def _is_due(self, t_ns: int) -> bool:
        period_ns = round(NS_PER_S / self._options.rate_hz)
        if self._due_ns is None or t_ns - self._due_ns > period_ns:
            self._due_ns = t_ns
        if t_ns < self._due_ns:
            return False
        self._due_ns += period_ns
        return True

    def _odometry(self, output: Any) -> Any:
        state = self._state
        r_LW = frames.R_LW_NORTH if state.heading_known else frames.R_LW_START
        r_BI = self._options.r_BI
        r_LB = r_LW @ _matrix(output.q_WI) @ r_BI.T
        p_L_m, v_L_m_s = r_LW @ output.p_WI_m, r_LW @ output.v_WI_m_s
        whole = np.reshape(state.covariance, (15, 15))
        local = frames.local_covariance(whole, r_LW, _matrix(state.q_WI))
        is_ned = self._options.say_north and state.heading_known
        return mavlink.MAVLink_odometry_message(
            output.time_ns // 1000,
            mavlink.MAV_FRAME_LOCAL_NED if is_ned else mavlink.MAV_FRAME_LOCAL_FRD,
            mavlink.MAV_FRAME_BODY_FRD,
            *p_L_m,
            Rotation.from_matrix(r_LB).as_quat(canonical=True, scalar_first=True).tolist(),
            *(r_LB.T @ v_L_m_s),
            *[np.nan] * 3,
            frames.pose_covariance(local).tolist(),
            frames.velocity_covariance(local, r_LB.T, v_L_m_s).tolist(),
            self._resets % 256,
            mavlink.MAV_ESTIMATOR_TYPE_VIO,
            quality(output),
        )

    def _distance(self, t_ns: int, range_m: float, sample_quality: int) -> Any:
        low_cm, high_cm = (round(100.0 * limit) for limit in self._options.range_limits_m)
        # No return is a distance beyond the largest.
        has_echo = sample_quality != RANGE_NO_RETURN and math.isfinite(range_m)
        cm = max(round(100.0 * range_m), 0) if has_echo else high_cm + 1
        variance_cm2 = round((100.0 * self._options.range_noise_m) ** 2)
        return mavlink.MAVLink_distance_sensor_message(
            t_ns // 1_000_000 % 2**32,
            low_cm,
            high_cm,
            min(cm, _MAX_CM),
            mavlink.MAV_DISTANCE_SENSOR_LASER,
            0,
            self._options.range_orientation,
            min(variance_cm2, _UNKNOWN_VARIANCE_CM2) or _UNKNOWN_VARIANCE_CM2,
            signal_quality=SIGNAL_PERFECT if has_echo and sample_quality == RANGE_VALID else SIGNAL_INVALID,
        )


def _matrix(q_wxyz: tuple[float, ...]) -> FloatArray:
    return np.asarray(Rotation.from_quat(q_wxyz, scalar_first=True).as_matrix())

