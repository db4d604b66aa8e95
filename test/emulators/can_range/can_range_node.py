#!/usr/bin/env python3
"""A DroneCAN range finder, played by the public Python package dronecan: an encoder that is not Plumb's.

    can_range_node.py frames            print the frames of many measurements, as `candump -L` does, and what they mean
    can_range_node.py on INTERFACE      be a node on a CAN interface: 25 ranges a second for some seconds, then stop
    can_range_node.py hear INTERFACE    print `status NODE_ID HEALTH MODE UPTIME_S` of every NodeStatus of other nodes, until
                                        none has come for 3 s, or for a minute at first

Before each transfer stands a line `range NODE_ID SENSOR_ID READING_TYPE RANGE_M`.
"""

import sys
import time

import dronecan
from dronecan import transport

NODES = {42: (0, 16), 125: (3, 24)}  # node id: sensor id, priority
RANGES_M = [0.05, 0.3, 1.0, 4.57, 12.5, 39.99, 100.0]


def measurement(sensor_id: int, range_m: float, reading_type: int) -> object:
    """The message."""
    message = dronecan.uavcan.equipment.range_sensor.Measurement()
    message.timestamp.usec = 0
    message.sensor_id = sensor_id
    message.beam_orientation_in_body_frame.fixed_axis_roll_pitch_yaw = [0, -6, 0]
    message.beam_orientation_in_body_frame.orientation_defined = True
    message.field_of_view = 0.0078125
    message.sensor_type = message.SENSOR_TYPE_LIDAR
    message.reading_type = reading_type
    message.range = range_m
    return message


def print_frames() -> None:
    """Two nodes in turn, all reading types."""
    stamp = 1000.0
    for i in range(100):
        for node_id, (sensor_id, priority) in NODES.items():
            range_m, reading_type = RANGES_M[i % len(RANGES_M)], i % 4
            print(f"range {node_id} {sensor_id} {reading_type} {range_m!r}")
            transfer = transport.Transfer(
                transfer_id=i % 32,
                source_node_id=node_id,
                payload=measurement(sensor_id, range_m, reading_type),
                transfer_priority=priority,
            )
            for frame in transfer.to_frames():
                stamp += 0.000131
                print(f"({stamp:.6f}) vcan0 {frame.message_id:08X}#{bytes(frame.bytes).hex().upper()}")
        stamp += 0.04


def print_statuses(interface: str, first_s: float = 60.0, offline_s: float = 3.0) -> None:
    """What other nodes say of themselves."""
    heard = time.monotonic() - offline_s + first_s

    def on_status(event: dronecan.node.TransferEvent) -> None:
        nonlocal heard
        heard = time.monotonic()
        status = event.message
        print("status", event.transfer.source_node_id, status.health, status.mode, status.uptime_sec, flush=True)

    node = dronecan.make_node(interface, bitrate=1000000)
    node.add_handler(dronecan.uavcan.protocol.NodeStatus, on_status)
    print("listening", flush=True)
    while time.monotonic() < heard + offline_s:
        node.spin(0.1)
    node.close()


def be_a_node(interface: str, seconds: float = 4.0) -> None:
    """Broadcasts a range that tells which one it is, and prints the NodeStatus of others."""
    node = dronecan.make_node(interface, node_id=42, bitrate=1000000)
    node.health = dronecan.uavcan.protocol.NodeStatus().HEALTH_OK
    node.add_handler(
        dronecan.uavcan.protocol.NodeStatus,
        lambda event: print(
            f"status {event.transfer.source_node_id} {event.message.health} {event.message.mode}", flush=True
        ),
    )
    end = time.monotonic() + seconds
    count = 0
    while time.monotonic() < end:
        node.broadcast(measurement(0, 1.0 + count * 0.0625, 1))
        count += 1
        node.spin(0.04)
    node.close()


if __name__ == "__main__":
    if sys.argv[1:2] == ["frames"]:
        print_frames()
    elif sys.argv[1:2] == ["on"] and len(sys.argv) == 3:
        be_a_node(sys.argv[2])
    elif sys.argv[1:2] == ["hear"] and len(sys.argv) == 3:
        print_statuses(sys.argv[2])
    else:
        sys.exit(__doc__)
