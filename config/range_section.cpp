#include "config/range_section.h"

#include <limits>
#include <optional>

namespace plumb {
namespace {

/// `alone`: no other device stands beside it, of which there can be only one.
void read_lidar_lite(const YamlFile& yaml, bool alone, lidar_lite::Options& options, const Steps& steps) {
  steps([&] {
    if (!alone && !yaml.has("model")) return;
    const std::string model = yaml.text("model");
    if (model == "v3")
      options.model = lidar_lite::Model::kV3;
    else if (model == "v3hp")
      options.model = lidar_lite::Model::kV3Hp;
    else if (model == "v4led")
      options.model = lidar_lite::Model::kV4Led;
    else
      yaml.fail("model", "expected v3, v3hp or v4led");
  });
  steps([&] { options.period = milliseconds_in(yaml, "period_ms", 40.0); });
  steps([&] {
    if (options.period < lidar_lite::kMinPeriod) yaml.fail("period_ms", "expected at least 10 ms");
  });
}

void read_dronecan(const YamlFile& yaml, RangeSetup& range, const Steps& steps) {
  steps([&] { range.can.node_id = whole_in(yaml, "node_id", range.can.node_id, can_range::kAny, 127); });
  steps([&] { range.can.sensor_id = whole_in(yaml, "sensor_id", range.can.sensor_id, can_range::kAny, 255); });
  steps([&] {
    if (range.can.node_id == 0) yaml.fail("node_id", "expected 1 to 127, or -1 for any");
  });
  steps([&] {
    const int id = whole_in(yaml, "own_node_id", range.node_status.node_id, 1, can_range::kMaxNodeId);
    if (id == range.can.node_id) yaml.fail("own_node_id", "expected another than the sensor's node_id");
    range.node_status.node_id = static_cast<std::uint8_t>(id);
  });
}

void read_benewake(const YamlFile& yaml, can_range::Options& can, const Steps& steps) {
  constexpr int kMaxWord = std::numeric_limits<std::uint16_t>::max();
  steps([&] {
    can.benewake_id = static_cast<std::uint32_t>(
        whole_in(yaml, "can_id", static_cast<int>(can.benewake_id), 0, static_cast<int>(kCanStandardIdMask)));
  });
  steps([&] {
    can.benewake_far_cm = static_cast<std::uint16_t>(
        whole_in(yaml, "far_cm", can.benewake_far_cm, can_range::kMinBenewakeFar_cm, kMaxWord));
  });
  steps([&] {
    can.benewake_min_strength =
        static_cast<std::uint16_t>(whole_in(yaml, "min_strength", can.benewake_min_strength, 0, kMaxWord));
  });
}

void read_can_range(const YamlFile& yaml, RangeSetup& range, const Steps& steps) {
  can_range::Options& can = range.can;
  std::optional<can_range::Protocol> protocol;
  steps([&] {
    const std::string word = yaml.text_or("protocol", "dronecan");
    if (word == "dronecan")
      protocol = can_range::Protocol::kDronecan;
    else if (word == "benewake")
      protocol = can_range::Protocol::kBenewake;
    else
      yaml.fail("protocol", "expected dronecan or benewake");
  });
  can.protocol = protocol.value_or(can.protocol);
  steps([&] { can.bus_bit_s = whole_in(yaml, "bus_bit_s", can.bus_bit_s, 10'000, 1'000'000); });
  steps([&] { can.latency = milliseconds_in(yaml, "latency_ms", 0.0); });
  // Beside a protocol that is not known, the keys of either may be right.
  if (protocol == can_range::Protocol::kBenewake) {
    refuse_keys(yaml, {"node_id", "sensor_id", "own_node_id"},
                "stands beside protocol: benewake; expected only beside protocol: dronecan", steps);
  } else {
    read_dronecan(yaml, range, steps);
  }
  if (protocol == can_range::Protocol::kDronecan) {
    refuse_keys(yaml, {"can_id", "far_cm", "min_strength"},
                "stands beside protocol: dronecan; expected only beside protocol: benewake", steps);
  } else {
    read_benewake(yaml, can, steps);
  }
}

}  // namespace

void read_range_section(const YamlFile& yaml, FlightSetup& setup, const Steps& steps) {
  RangeSetup& range = setup.range;
  const bool lidar_lite = yaml.has("i2c");
  const bool can = yaml.has("can");
  steps([&] {
    if (lidar_lite == can) yaml.fail("i2c", "expected either i2c or can");
    range.kind = lidar_lite ? RangeDevice::kLidarLite : RangeDevice::kCan;
    range.device = yaml.text(lidar_lite ? "i2c" : "can");
  });
  if (can) read_can_range(yaml, range, steps);
  if (lidar_lite) read_lidar_lite(yaml, !can, range.lidar_lite, steps);
  read_range_finder(yaml, setup.calibration, setup.parameters, steps);
}

}  // namespace plumb
