#pragma once
// A CAN range finder with two faces. The bus face puts out the frames of a DroneCAN node or of a Benewake, to the bit
// and one after the other as the bus carries them. The physical face is what a test does to it: the distance that it
// sees, and what goes wrong. Time is what the caller says it is; can_range_on_bus.h runs it on a real interface.

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <random>
#include <vector>

#include "hal/include/can_socket.h"
#include "test/emulators/can_range/can_range_encoder.h"

namespace plumb::test {

/// A frame, and when its last bit was on the bus [ns].
struct CanTransmission {
  std::int64_t t_end_ns = 0;
  CanFrame frame;
};

struct CanRangeFaults {
  double flipped_bit = 0.0;  ///< probability per frame of one wrong bit in its data
  double lost_frame = 0.0;   ///< probabilities per frame
  double doubled_frame = 0.0;
  bool stuck = false;         ///< it repeats the last distance; transfer ids run
  bool not_a_number = false;  ///< DroneCAN
  std::int64_t late_ns = 0;   ///< frames come that much later
  bool silent = false;        ///< pulled: nothing comes, the unit runs on
};

class CanRangeEmulator {
 public:
  enum class Kind : std::uint8_t { kDronecan = 0, kTf03, kTfminiI };

  static constexpr std::int64_t kPeriod_ns = 40'000'000;
  static constexpr std::int64_t kLatency_ns = 2'000'000;  ///< from the middle of a measurement to the first frame
  static constexpr double kNearest_m = 0.1;
  static constexpr double kFarthest_m = 180.0;

  /// Measures every period from `t_on_ns` on.
  CanRangeEmulator(Kind kind, std::int64_t t_on_ns, std::uint64_t seed)
      : kind_(kind), t_next_ns_(t_on_ns), random_(seed) {}

  // Physical face.
  /// Distance of the target; nothing: no target.
  void set_range_m(std::optional<double> range_m) {
    range_at_ = [range_m](std::int64_t) { return range_m; };
  }
  /// A target that moves: its distance over time [ns]. A measurement sees it in its middle.
  void set_motion(std::function<std::optional<double>(std::int64_t)> range_at) { range_at_ = std::move(range_at); }
  CanRangeFaults& faults() { return faults_; }
  /// Who the node is, and what it says besides the range.
  DronecanSensor& sensor() { return sensor_; }
  void set_bit_rate(std::int64_t bits_s) { bits_s_ = bits_s; }

  // Bus face.
  /// All that ended on the bus up to `t_ns`, in order. Precondition: time does not go back.
  std::vector<CanTransmission> run_until(std::int64_t t_ns);

 private:
  void measure(std::int64_t t_ns);
  std::vector<CanFrame> frames_of(std::optional<double> range_m, std::int64_t t_ns);
  std::int64_t time_on_bus_ns(const CanFrame& frame) const;
  bool happens(double probability);

  Kind kind_;
  DronecanSensor sensor_;
  std::int64_t bits_s_ = 1'000'000;
  std::function<std::optional<double>(std::int64_t)> range_at_;
  CanRangeFaults faults_;
  std::int64_t t_next_ns_;
  std::int64_t t_bus_free_ns_ = 0;
  unsigned transfer_ = 0;
  std::optional<double> last_m_;
  std::mt19937_64 random_;
  std::deque<CanTransmission> on_the_way_;
};

}  // namespace plumb::test
