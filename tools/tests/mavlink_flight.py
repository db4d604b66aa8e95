"""Messages of a made-up flight for the bridge, and an autopilot's end of a line."""

from __future__ import annotations

import socket
import time
from pathlib import Path
from typing import Any

import lcm
import numpy as np
from pymavlink.dialects.v20 import common as mavlink
from scipy.spatial.transform import Rotation

from plumb_tools.message_types import types
from plumb_tools.trajectory import FloatArray

START_NS = 5_000_000_123
PERIOD_NS = 4_000_000  #: of the outputs
PATIENCE_S = 120.0  #: with a machine that does much else

Event = tuple[str, bytes]


def random_covariance(random: np.random.Generator, size: int = 15) -> FloatArray:
    """Symmetric and positive definite."""
    root = random.normal(size=(size, size))
    return root @ root.T / size


def state(t_ns: int, covariance: FloatArray, **values: Any) -> Event:
    """NAV_STATE with a state by range, camera and IMU, where `values` do not say otherwise."""
    message = types().nav_state_t()
    message.time_ns = t_ns
    message.valid, message.mode = True, 1
    message.q_WI = (1.0, 0.0, 0.0, 0.0)
    message.covariance = covariance.ravel().tolist()
    for name, value in values.items():
        setattr(message, name, value)
    return "NAV_STATE", message.encode()


def output(
    t_ns: int, p: FloatArray | None = None, v: FloatArray | None = None, q: Rotation | None = None, **values: Any
) -> Event:
    """NAV_OUTPUT that may be acted on, where `values` do not say otherwise."""
    message = types().nav_output_t()
    message.time_ns = t_ns
    message.p_WI_m = np.zeros(3).tolist() if p is None else p.tolist()
    message.v_WI_m_s = np.zeros(3).tolist() if v is None else v.tolist()
    message.q_WI = (Rotation.identity() if q is None else q).as_quat(scalar_first=True).tolist()
    message.valid, message.mode = True, 1
    for name, value in values.items():
        setattr(message, name, value)
    return "NAV_OUTPUT", message.encode()


def write_log(path: Path, events: list[tuple[int, Event]]) -> Path:
    """An LCM event log of messages and their stamps [ns]."""
    log = lcm.EventLog(str(path), mode="w", overwrite=True)
    for t_ns, (channel, data) in events:
        log.write_event(t_ns // 1000, channel, data)
    log.close()
    return path


class Autopilot:
    """A UDP socket with pymavlink's own decoder behind it."""

    def __init__(self) -> None:
        """On a port that is free."""
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.2)
        self.decoder = mavlink.MAVLink(None, srcSystem=1, srcComponent=mavlink.MAV_COMP_ID_AUTOPILOT1)
        self.packets: list[bytes] = []

    @property
    def connect(self) -> str:
        """What the bridge is told."""
        return f"udpout:127.0.0.1:{self.socket.getsockname()[1]}"

    def received(self, kind: str, at_least: int = 0, within_s: float = PATIENCE_S) -> list[Any]:
        """Messages of a kind that have come, and come until there are `at_least` so many or time is over."""
        found: list[Any] = []
        end_s = time.monotonic() + within_s
        while time.monotonic() < end_s:
            try:
                packet, self.peer = self.socket.recvfrom(4096)
            except TimeoutError:
                if len(found) >= at_least:
                    break
                continue
            self.packets.append(packet)
            found += [message for message in self.decoder.parse_buffer(packet) or [] if message.get_type() == kind]
            if at_least and len(found) >= at_least:
                break
        return found

    def all_received(self, kind: str) -> list[Any]:
        """Messages of a kind in all packets so far."""
        decoder = mavlink.MAVLink(None)
        found = (message for packet in self.packets for message in decoder.parse_buffer(packet) or [])
        return [message for message in found if message.get_type() == kind]

    def send(self, message: Any) -> None:
        """To the bridge, which has been heard before."""
        self.socket.sendto(message.pack(self.decoder), self.peer)
