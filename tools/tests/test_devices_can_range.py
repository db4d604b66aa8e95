"""CAN range finders: the reference's frames to the bit, a receiver of its own, and the public DroneCAN package."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import dronecan
import numpy as np
import pytest
from dronecan import transport

from devices_flight import made_up_flight
from plumb_tools.sim.devices.can_range import (
    MEASUREMENT_SIGNATURE,
    MEASUREMENT_TYPE_ID,
    NODE_STATUS_SIGNATURE,
    NODE_STATUS_TYPE_ID,
    CanFrame,
    CanProtocol,
    CanRangeSettings,
    Measurement,
    Reading,
    SensorType,
    TimedCanFrame,
    benewake_frame,
    broadcast,
    can_frames,
    encode_node_status,
    frame_time_ns,
)
from plumb_tools.sim.devices.crc import crc16_ccitt_false

VALID = Measurement(12.5, Reading.VALID, SensorType.LIDAR, 0.0078125, orientation=(0, -6, 0))
TOO_FAR = Measurement(40.0, Reading.TOO_FAR, SensorType.LIDAR, 0.05, (0, 6, 0), 3, 1234567890123)
TOO_CLOSE = Measurement(0.3, Reading.TOO_CLOSE, SensorType.UNDEFINED, 0.0, None, 1, 17730434519136)

# Measurement, transfer id, node id, priority and the frames in candump's notation.
TRANSFERS = {
    "valid": (VALID, 0, 42, 16, "10041A2A#0F8B000000000080 10041A2A#0000000681002020 10041A2A#11404A40"),
    "too far": (TOO_FAR, 31, 125, 24, "18041A7D#3947CB04FB711F9F 18041A7D#0100030181662A3F 18041A7D#1300515F"),
}


def candump(frames: list[CanFrame]) -> str:
    return " ".join(f"{frame.can_id:0{8 if frame.is_extended else 3}X}#{frame.data.hex().upper()}" for frame in frames)


def measurement_frames(message: Measurement, transfer_id: int, node_id: int, priority: int) -> list[CanFrame]:
    return broadcast(MEASUREMENT_TYPE_ID, MEASUREMENT_SIGNATURE, message.encode(), transfer_id, node_id, priority)


@dataclass
class Received:
    time_ns: int  #: end of the first frame
    type_id: int
    transfer_id: int
    payload: bytes


def receive(frames: list[TimedCanFrame], signatures: dict[int, int]) -> list[Received]:
    """Puts transfers together and checks tail bytes and checksum, one after the other as they stand on the bus."""
    received: list[Received] = []
    parts: list[bytes] = []
    first_ns = 0
    for timed in frames:
        data, tail = timed.frame.data[:-1], timed.frame.data[-1]
        if tail & 0x80:
            parts, first_ns = [], timed.time_ns
        assert (tail >> 5 & 1) == len(parts) % 2
        parts.append(data)
        if not tail & 0x40:
            assert len(data) == 7
            continue
        payload = b"".join(parts)
        type_id = timed.frame.can_id >> 8 & 0xFFFF
        if len(parts) > 1:
            crc = 0xFFFF
            for byte in struct.pack("<Q", signatures[type_id]) + payload[2:]:
                crc ^= byte << 8
                for _ in range(8):
                    crc = crc << 1 ^ (0x1021 if crc & 0x8000 else 0)
                    crc &= 0xFFFF
            assert crc == payload[0] | payload[1] << 8
            payload = payload[2:]
        received.append(Received(first_ns, type_id, tail & 0x1F, payload))
    return received


def range_and_reading(payload: bytes) -> tuple[float, int]:
    half = payload[13] | payload[14] << 8
    exponent, fraction = half >> 10 & 0x1F, half & 0x3FF
    value = (fraction / 1024.0 + (exponent > 0)) * 2.0 ** (max(exponent, 1) - 15)
    return value, payload[12] & 0x7


def test_transfer_checksum_of_the_signature() -> None:
    assert crc16_ccitt_false(MEASUREMENT_SIGNATURE.to_bytes(8, "little")) == 0x049C
    assert crc16_ccitt_false(b"123456789") == 0x29B1


@pytest.mark.parametrize("name", TRANSFERS)
def test_transfers_of_the_reference(name: str) -> None:
    message, transfer_id, node_id, priority, frames = TRANSFERS[name]
    assert candump(measurement_frames(message, transfer_id, node_id, priority)) == frames


def test_a_transfer_of_the_reference_that_is_too_close() -> None:
    frames = measurement_frames(TOO_CLOSE, 5, 7, 16)
    assert candump(frames) == "10041A07#0044605040302085 10041A07#1000010000000025 10041A07#02CD3445"


def test_node_status_of_the_reference() -> None:
    payload = encode_node_status(3661, health=1, mode=1, vendor_code=0x1234)
    assert candump(broadcast(NODE_STATUS_TYPE_ID, NODE_STATUS_SIGNATURE, payload, 3, 42, 16)) == (
        "1001552A#4D0E0000483412C3"
    )


def test_native_frames_of_the_reference() -> None:
    assert candump([benewake_frame(CanProtocol.TF03, 1234, 500, 0)]) == "003#D204F4010000"
    assert candump([benewake_frame(CanProtocol.TFMINI_I, 1234, 500, 1000)]) == "003#D204F401E8030000"


@pytest.mark.parametrize("message", [VALID, TOO_FAR, TOO_CLOSE])
def test_the_public_implementation_reads_the_same(message: Measurement) -> None:
    transfer = transport.Transfer()
    transfer.from_frames(
        [transport.Frame(frame.can_id, frame.data) for frame in measurement_frames(message, 9, 42, 16)]
    )
    read = transfer.payload
    assert dronecan.get_dronecan_data_type(read).full_name == "uavcan.equipment.range_sensor.Measurement"
    assert (transfer.source_node_id, transfer.transfer_id) == (42, 9)
    assert read.range == pytest.approx(message.range_m, rel=2**-11)
    assert read.field_of_view == pytest.approx(message.field_of_view_rad, rel=2**-11)
    assert (read.reading_type, read.sensor_type) == (message.reading, message.sensor_type)
    assert (read.sensor_id, read.timestamp.usec) == (message.sensor_id, message.timestamp_us)
    beam = read.beam_orientation_in_body_frame
    assert bool(beam.orientation_defined) == (message.orientation is not None)
    roll_pitch_yaw = tuple(beam.fixed_axis_roll_pitch_yaw)
    assert roll_pitch_yaw == (message.orientation or (0, 0, 0))


def test_every_range_comes_back_to_half_precision_with_its_stamp() -> None:
    flight = made_up_flight(seconds=4.0)
    settings = CanRangeSettings(latency_ns=1_500_000)
    signatures = {MEASUREMENT_TYPE_ID: MEASUREMENT_SIGNATURE}
    received = receive(list(can_frames(flight, settings)), signatures)
    ranges = [item for item in received if item.type_id == MEASUREMENT_TYPE_ID]
    assert [item.transfer_id for item in ranges] == [i % 32 for i in range(len(flight.range_m))]
    read = [range_and_reading(item.payload) for item in ranges]
    assert np.allclose([value for value, _ in read], flight.range_m, rtol=2**-11, atol=0.0)
    assert {reading for _, reading in read} == {1}
    # An extended frame of 8 bytes is 131 bits at 1 Mbit/s.
    assert [item.time_ns - 1_500_000 - 131_000 for item in ranges] == flight.range_t_ns.tolist()

    status = [item for item in received if item.type_id == NODE_STATUS_TYPE_ID]
    assert [struct.unpack("<IBH", item.payload)[:2] for item in status] == [(second, 0) for second in range(4)]
    assert [item.transfer_id for item in status] == [0, 1, 2, 3]


def test_readings_tell_why_there_is_no_range() -> None:
    flight = made_up_flight()
    flight.range_m[:4] = [0.0, 41.0, 0.02, 10.0]
    received = receive(list(can_frames(flight, CanRangeSettings())), {MEASUREMENT_TYPE_ID: MEASUREMENT_SIGNATURE})
    read = [range_and_reading(item.payload) for item in received if item.type_id == MEASUREMENT_TYPE_ID]
    assert [reading for _, reading in read[:4]] == [3, 3, 2, 1]
    assert read[0][0] == read[1][0] == 40.0


@pytest.mark.parametrize(
    "protocol, bus_bit_s, size", [(CanProtocol.TF03, 1_000_000, 6), (CanProtocol.TFMINI_I, 250_000, 8)]
)
def test_native_frames_bring_centimetres(protocol: CanProtocol, bus_bit_s: int, size: int) -> None:
    flight = made_up_flight()
    flight.range_m[2] = 0.0
    timed = list(can_frames(flight, CanRangeSettings(protocol=protocol, bus_bit_s=bus_bit_s)))
    assert all(not item.frame.is_extended and len(item.frame.data) == size for item in timed)
    centimetres = np.array([struct.unpack("<H", item.frame.data[:2])[0] for item in timed])
    assert centimetres[2] == 18000 and timed[2].frame.data[2:4] == b"\0\0"
    measured = np.arange(len(timed)) != 2
    assert np.max(np.abs(centimetres / 100.0 - flight.range_m)[measured]) <= 0.005001
    wire_ns = (47 + 8 * size) * 1_000_000_000 // bus_bit_s
    assert [item.time_ns - wire_ns for item in timed] == flight.range_t_ns.tolist()


def test_frames_wait_for_the_bus() -> None:
    flight = made_up_flight()
    flight.range_t_ns = flight.range_t_ns[0] + 100_000 * np.arange(len(flight.range_t_ns))
    timed = list(can_frames(flight, CanRangeSettings()))
    for before, after in zip(timed, timed[1:]):
        assert after.time_ns - frame_time_ns(after.frame, 1_000_000) >= before.time_ns
