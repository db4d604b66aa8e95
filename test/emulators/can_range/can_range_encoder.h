#pragma once
// The frames of CAN range finders, from a physical range. Written from the specification bit by bit; it shares no code
// with the driver.

#include <cstdint>
#include <vector>

#include "hal/include/can_socket.h"

namespace plumb::test {

struct DronecanSensor {
  unsigned node_id = 42;
  unsigned priority = 16;
  unsigned sensor_id = 0;
  std::uint64_t timestamp_us = 0;
  bool has_orientation = false;
  int roll = 0;  ///< steps of 15 degrees
  int pitch = 0;
  int yaw = 0;
  double field_of_view_rad = 0.0;
  unsigned sensor_type = 2;  ///< lidar
};

/// Nearest half-precision number, ties away from zero; for values from 2^-14 to 65504, 0, not-a-number and
/// infinity.
std::uint16_t to_half(double value);

/// Frames of one uavcan.equipment.range_sensor.Measurement. `reading_type`: 1 valid, 2 too close, 3 too far.
std::vector<CanFrame> measurement_frames(const DronecanSensor& sensor, double range_m, unsigned reading_type,
                                         unsigned transfer_id);

/// A Benewake's own frame: 6 bytes (TF03), or 8 with the device's time (TFmini-i).
CanFrame benewake_frame(unsigned distance_cm, unsigned strength);
CanFrame benewake_frame(unsigned distance_cm, unsigned strength, std::uint32_t time_ms);

}  // namespace plumb::test
