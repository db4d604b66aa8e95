"""The line to the autopilot: what a MAVLink component owes besides its data, and what it hears."""

from __future__ import annotations

import os
import re
import socket
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ["MAVLINK20"] = "1"  # pymavlink asks for it when it is imported

from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mavlink

from plumb_tools.trajectory import InputError

COMPONENT = mavlink.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY
#: Of connections by network; anything else is the name of a serial device.
NETWORK = re.compile(r"(?:udpout|udpin|udpbcast):([^:]+):([0-9]+)")
EXPECTED = "expected udpout:HOST:PORT, udpin:HOST:PORT, udpbcast:HOST:PORT or a serial device such as /dev/ttyS1"


class LinkLost(Exception):
    """The device is gone."""


class Link:
    """A component of a system on a MAVLink connection."""

    def __init__(self, connect: str, baud: int, system: int, now_ns: Callable[[], int]) -> None:
        """`now_ns` is the clock that the stamps are of."""
        network = NETWORK.fullmatch(connect)
        if network is None and not Path(connect).is_char_device():
            raise InputError(f"--connect {connect}: no such device; {EXPECTED}")
        if network is not None and not 0 < int(network[2]) < 65536:
            raise InputError(f"--connect {connect}: no such port; expected 1 to 65535")
        try:
            if network is not None:  # else a name that nobody knows would be told at no message
                socket.gethostbyname(network[1])
            self._connection = mavutil.mavlink_connection(
                connect, baud=baud, source_system=system, source_component=COMPONENT, dialect="common"
            )
        except (OSError, ValueError, OverflowError) as error:
            raise InputError(f"--connect {connect}: cannot be opened: {error}; {EXPECTED}") from None
        self._now_ns = now_ns
        self._connect = connect
        self.heard: Counter[str] = Counter()  #: messages received

    @property
    def descriptor(self) -> int:
        """To wait for what comes."""
        return int(self._connection.fd)

    def send(self, message: Any) -> None:
        """Sends a message; LinkLost where the device is gone."""
        self._connection.mav.send(message)
        if self._connection.portdead:
            raise LinkLost(f"--connect {self._connect}: the device is gone")

    def send_heartbeat(self, is_active: bool) -> None:
        """Says that it is there, and whether it has something to navigate by; once a second."""
        state = mavlink.MAV_STATE_ACTIVE if is_active else mavlink.MAV_STATE_STANDBY
        self.send(
            mavlink.MAVLink_heartbeat_message(
                mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, state, 3
            )
        )

    def receive(self) -> None:
        """Takes what has come, and answers who asks for the time."""
        while (message := self._next()) is not None:
            self.heard[message.get_type()] += 1
            if message.get_type() == "TIMESYNC" and message.tc1 == 0:
                self.send(mavlink.MAVLink_timesync_message(self._now_ns(), message.ts1))

    def _next(self) -> Any:
        try:
            return self._connection.recv_msg()
        except OSError as error:
            raise LinkLost(f"--connect {self._connect}: {error}") from None

    def close(self) -> None:
        """Gives the device or the port back."""
        self._connection.close()
