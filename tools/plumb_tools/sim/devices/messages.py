"""Records of the log as LCM messages."""

from __future__ import annotations


import numpy as np

from plumb_tools.message_types import types
from plumb_tools.sim.devices.camera import PIXEL_FORMAT_GREY, CameraBuffer
from plumb_tools.sim.devices.can_range import TimedCanFrame
from plumb_tools.sim.devices.field_of_view import DISTORTION_CODES, coefficients, half_field_of_view
from plumb_tools.sim.devices.flight_protocol import Calibration, FloatArray
from plumb_tools.sim.devices.lidar_lite import ADDRESS, I2cTransfer
from plumb_tools.sim.devices.stim300_stream import SerialChunk

_SERIAL_CAPACITY = 256
_TRANSFER_CAPACITY = 8


def serial_chunk(chunk: SerialChunk) -> bytes:
    """raw_bytes_t."""
    message = types().raw_bytes_t()
    message.time_ns = chunk.time_ns
    message.size = len(chunk.data)
    message.bytes = chunk.data.ljust(_SERIAL_CAPACITY, b"\0")
    return bytes(message.encode())


def i2c_transfer(transfer: I2cTransfer) -> bytes:
    """i2c_transfer_t."""
    message = types().i2c_transfer_t()
    message.time_ns = transfer.time_ns
    message.duration_ns = transfer.duration_ns
    message.address = ADDRESS
    message.is_read = transfer.is_read
    message.acknowledged = True
    message.size = len(transfer.data)
    message.bytes = transfer.data.ljust(_TRANSFER_CAPACITY, b"\0")
    return bytes(message.encode())


def can_frame(timed: TimedCanFrame) -> bytes:
    """can_frame_t."""
    message = types().can_frame_t()
    message.time_ns = timed.time_ns
    message.id = timed.frame.can_id
    message.is_extended = timed.frame.is_extended
    message.size = len(timed.frame.data)
    message.bytes = timed.frame.data.ljust(_TRANSFER_CAPACITY, b"\0")
    return bytes(message.encode())


def camera_buffer(buffer: CameraBuffer) -> bytes:
    """camera_buffer_t."""
    message = types().camera_buffer_t()
    message.time_ns = buffer.stamp_ns
    message.flags = buffer.flags
    message.sequence = buffer.sequence
    message.pixel_format = PIXEL_FORMAT_GREY
    message.height, message.width = buffer.pixels.shape
    message.stride = message.width
    message.size = buffer.pixels.size
    message.exposure_lines = buffer.exposure.lines
    message.gain = buffer.exposure.gain
    message.line_time_ns = buffer.line_time_ns
    message.readout_ns = buffer.readout_ns
    return bytes(message.encode())


def image(buffer: CameraBuffer) -> bytes:
    """image_t."""
    message = types().image_t()
    message.time_ns = buffer.mid_exposure_ns
    message.sequence = buffer.sequence
    message.height, message.width = buffer.pixels.shape
    message.size = buffer.pixels.size
    message.pixels = buffer.pixels.tobytes()
    return bytes(message.encode())


def truth(t_ns: int, p_m: FloatArray, v_m_s: FloatArray, q_wxyz: FloatArray, biases: FloatArray) -> bytes:
    """truth_t; the biases are those of gyro [rad/s] and accelerometer [m/s^2], six numbers."""
    message = types().truth_t()
    message.time_ns = t_ns
    message.p_WI_m = p_m.tolist()
    message.v_WI_m_s = v_m_s.tolist()
    message.q_WI = q_wxyz.tolist()
    message.b_gyro_rad_s = biases[:3].tolist()
    message.b_accel_m_s2 = biases[3:].tolist()
    return bytes(message.encode())


def _unit(vector: FloatArray) -> list[float]:
    return list((np.asarray(vector, dtype=np.float64) / np.linalg.norm(vector)).tolist())


def calibration(of: Calibration) -> bytes:
    """calibration_t."""
    message = types().calibration_t()
    message.width, message.height = of.width, of.height
    message.fx, message.fy, message.cx, message.cy = of.intrinsics
    message.coefficients = coefficients(of)  # checks the model too
    message.distortion = DISTORTION_CODES[of.distortion_model]
    message.q_IC = _unit(np.asarray(of.q_IC_wxyz))
    message.p_IC_m = list(of.p_IC_m)
    message.p_CR_m = list(of.p_CR_m)
    message.u_C = _unit(np.asarray(of.u_C))
    message.focal_px = 0.5 * (message.fx + message.fy)
    message.half_fov_x, message.half_fov_y = half_field_of_view(of)
    return bytes(message.encode())
