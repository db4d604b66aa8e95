"""A flight's ranges as the CAN frames of a DroneCAN range finder, or of a Benewake one with frames of its own.

Facts: DroneCAN specification, "CAN bus transport layer" (identifier, tail byte, transfer checksum) and "Data structure
description language" (packing); public_regulated_data_types b4653c7, uavcan/equipment/range_sensor/1050.Measurement and
uavcan/protocol/341.NodeStatus; Benewake TF03 manual V1.2.2 page 12 and TFmini-i manual (native frames).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum, IntEnum

from plumb_tools.sim.devices.crc import crc16_ccitt_false
from plumb_tools.sim.devices.flight_protocol import Flight

MEASUREMENT_TYPE_ID = 1050
MEASUREMENT_SIGNATURE = 0x68FFFE70FC771952
NODE_STATUS_TYPE_ID = 341
NODE_STATUS_SIGNATURE = 0x0F0868D0C1A7C6F1
_NODE_STATUS_PERIOD_NS = 1_000_000_000

_BENEWAKE_ID = 0x003
_BENEWAKE_NO_RETURN_CM = 18000
_BENEWAKE_STRENGTH = 500

# Bits of a data frame without data and without stuff bits, the pause after it included.
_FRAME_BITS = 47
_EXTENDED_FRAME_BITS = 67


class CanProtocol(Enum):
    """Who talks on the bus."""

    DRONECAN = "dronecan"
    TF03 = "tf03"
    TFMINI_I = "tfmini_i"


class SensorType(IntEnum):
    """uavcan.equipment.range_sensor.Measurement, sensor_type."""

    UNDEFINED = 0
    SONAR = 1
    LIDAR = 2
    RADAR = 3


class Reading(IntEnum):
    """uavcan.equipment.range_sensor.Measurement, reading_type."""

    UNDEFINED = 0
    VALID = 1
    TOO_CLOSE = 2
    TOO_FAR = 3


@dataclass(frozen=True)
class CanRangeSettings:
    """The device and its bus."""

    protocol: CanProtocol = CanProtocol.DRONECAN
    bus_bit_s: int = 1_000_000  #: the TFmini-i comes set to 250000
    node_id: int = 42
    priority: int = 16
    sensor_id: int = 0
    field_of_view_rad: float = 0.0078125
    min_range_m: float = 0.05
    max_range_m: float = 40.0
    latency_ns: int = 0  #: from the middle of a measurement to the start of its first frame


@dataclass(frozen=True)
class CanFrame:
    """A classic CAN data frame."""

    can_id: int  #: without flags
    is_extended: bool
    data: bytes


@dataclass(frozen=True)
class TimedCanFrame:
    """A frame as the host got it."""

    time_ns: int  #: end of the frame
    frame: CanFrame


@dataclass(frozen=True)
class Measurement:
    """uavcan.equipment.range_sensor.Measurement."""

    range_m: float
    reading: Reading
    sensor_type: SensorType = SensorType.LIDAR
    field_of_view_rad: float = 0.0
    #: Roll, pitch, yaw of the beam in steps of 15 degrees, -16 to 15; None where the node does not tell.
    orientation: tuple[int, int, int] | None = None
    sensor_id: int = 0
    timestamp_us: int = 0  #: 0: the node does not know the time

    def encode(self) -> bytes:
        """The 15 bytes of the message. Bit fields are filled from the most significant bit."""
        bits = 0
        for angle in self.orientation or (0, 0, 0):
            bits = bits << 5 | angle & 0x1F
        bits = bits << 1 | (self.orientation is not None)
        return (
            self.timestamp_us.to_bytes(7, "little")
            + bytes([self.sensor_id])
            + bits.to_bytes(2, "big")
            + struct.pack("<e", self.field_of_view_rad)
            + bytes([self.sensor_type << 3 | self.reading])
            + struct.pack("<e", self.range_m)
        )


def encode_node_status(uptime_s: int, health: int = 0, mode: int = 0, vendor_code: int = 0) -> bytes:
    """uavcan.protocol.NodeStatus: health 0 is good, mode 0 operational."""
    return struct.pack("<IBH", uptime_s, health << 6 | mode << 3, vendor_code)


def broadcast(
    type_id: int, signature: int, payload: bytes, transfer_id: int, node_id: int, priority: int
) -> list[CanFrame]:
    """Frames of a DroneCAN message transfer."""
    can_id = priority << 24 | type_id << 8 | node_id
    if len(payload) > 7:
        payload = struct.pack("<H", crc16_ccitt_false(signature.to_bytes(8, "little") + payload)) + payload
    parts = [payload[i : i + 7] for i in range(0, len(payload), 7)]
    frames = []
    for i, part in enumerate(parts):
        first, last, toggle = i == 0, i == len(parts) - 1, i % 2
        tail = first << 7 | last << 6 | toggle << 5 | transfer_id % 32
        frames.append(CanFrame(can_id, True, part + bytes([tail])))
    return frames


def benewake_frame(protocol: CanProtocol, distance_cm: int, strength: int, uptime_ms: int) -> CanFrame:
    """The frame of a TF03 or a TFmini-i."""
    data = struct.pack("<HH", distance_cm, strength)
    data += bytes(2) if protocol is CanProtocol.TF03 else struct.pack("<I", uptime_ms)
    return CanFrame(_BENEWAKE_ID, False, data)


def frame_time_ns(frame: CanFrame, bus_bit_s: int) -> int:
    """Time of a frame on the bus; stuff bits, up to a fifth more, are not counted."""
    bits = (_EXTENDED_FRAME_BITS if frame.is_extended else _FRAME_BITS) + 8 * len(frame.data)
    return round(bits * 1e9 / bus_bit_s)


def reading_of(range_m: float, settings: CanRangeSettings) -> Reading:
    """How the device judges a range; 0 is no return, which it calls too far."""
    if not 0.0 < range_m <= settings.max_range_m:
        return Reading.TOO_FAR
    return Reading.TOO_CLOSE if range_m < settings.min_range_m else Reading.VALID


def _measurement_frames(index: int, range_m: float, settings: CanRangeSettings) -> list[CanFrame]:
    reading = reading_of(range_m, settings)
    message = Measurement(
        settings.max_range_m if reading is Reading.TOO_FAR else range_m,
        reading,
        field_of_view_rad=settings.field_of_view_rad,
        sensor_id=settings.sensor_id,
    )
    return broadcast(
        MEASUREMENT_TYPE_ID, MEASUREMENT_SIGNATURE, message.encode(), index, settings.node_id, settings.priority
    )


def _native_frames(t_ns: int, range_m: float, settings: CanRangeSettings) -> list[CanFrame]:
    valid = reading_of(range_m, settings) is not Reading.TOO_FAR
    distance_cm, strength = (round(range_m * 100.0), _BENEWAKE_STRENGTH) if valid else (_BENEWAKE_NO_RETURN_CM, 0)
    return [benewake_frame(settings.protocol, distance_cm, strength, t_ns // 1_000_000 % (1 << 32))]


def can_frames(flight: Flight, settings: CanRangeSettings) -> Iterator[TimedCanFrame]:
    """Every range of the flight, and for DroneCAN the node's status once per second, behind a range.

    The first frame of a range ends at its stamp + latency + the frame's time on the bus, or later if the bus is busy;
    the others follow at once.
    """
    dronecan = settings.protocol is CanProtocol.DRONECAN
    status_count = 0
    end_ns = 0
    for i, (t_ns, range_m) in enumerate(zip(flight.range_t_ns.tolist(), flight.range_m.tolist(), strict=True)):
        if dronecan:
            frames = _measurement_frames(i, range_m, settings)
            uptime_ns = t_ns - int(flight.range_t_ns[0])
            if uptime_ns >= status_count * _NODE_STATUS_PERIOD_NS:
                status = encode_node_status(uptime_ns // 1_000_000_000)
                frames += broadcast(
                    NODE_STATUS_TYPE_ID,
                    NODE_STATUS_SIGNATURE,
                    status,
                    status_count,
                    settings.node_id,
                    settings.priority,
                )
                status_count += 1
        else:
            frames = _native_frames(t_ns, range_m, settings)
        end_ns = max(end_ns, t_ns + settings.latency_ns)
        for frame in frames:
            end_ns += frame_time_ns(frame, settings.bus_bit_s)
            yield TimedCanFrame(end_ns, frame)
