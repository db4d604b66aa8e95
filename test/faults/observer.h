#pragma once
// What a flight told of itself by its telemetry, and how far that was from the truth.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "fsw/measurement/nav_state.h"
#include "hal/include/telemetry_sink.h"
#include "test/live/plane_flight.h"

namespace plumb::faults {

/// One NAV_OUTPUT against the truth.
struct SeenOutput {
  double t_s = 0.0;    ///< when it was told, since the flight began
  double age_s = 0.0;  ///< of the sample that it is for, when it was told
  bool valid = false;
  NavMode mode = NavMode::kInitialising;
  double reliable_for_s = 0.0;
  int reset_count = 0;
  /// Where the output is valid. Position and heading begin at zero with each start of the filter, so they are compared
  /// from the first valid output of that start on.
  double position_error_m = 0.0;
  double velocity_error_m_s = 0.0;
};

/// Between device and counter in the words of an event: "STIM300 counts checksum_errors".
inline constexpr const char* kCounts = " counts ";

/// One event in words: "camera silent", "mode inertial", "filter reset", "command refused: checksum".
struct SeenEvent {
  double t_s = 0.0;
  std::string words;
};

struct SeenFlight {
  std::vector<SeenOutput> outputs;
  std::vector<SeenEvent> events;
  std::vector<std::uint64_t> state_hashes;  ///< of every NAV_STATE
};

class Observer final : public TelemetrySink {
 public:
  /// `flight` in seconds on the world's clock, as t_start_s; must outlive the observer.
  Observer(const test::PlaneFlight& flight, double t_start_s) : flight_(flight), t_start_s_(t_start_s) {}

  /// The flight clock is ahead of the world by that much.
  void set_clock_offset(std::int64_t offset_ns) { offset_ns_ = offset_ns; }
  /// What is told from now on is told at that time since the flight began. Without a call it is told when it is
  /// stamped.
  void set_now(double t_s) { now_s_ = t_s; }
  Status publish(const char* channel, std::span<const std::uint8_t> message) override;
  int last_error() const override { return 0; }

  const SeenFlight& seen() const { return seen_; }
  void forget() {
    seen_.outputs.clear();
    seen_.events.clear();
    seen_.state_hashes.clear();
  }

 private:
  using Vector = std::array<double, 3>;
  struct Start {
    bool known = false;
    int reset_count = 0;
    double turn_rad = 0.0;  ///< from the estimate's world to the flight's
    Vector p_m{};           ///< of the estimate
    Vector p_true_m{};
  };
  double told_s(double t_world_s) const { return now_s_ < 0.0 ? t_world_s - t_start_s_ : now_s_; }
  double world_s(std::int64_t t_ns) const { return 1e-9 * static_cast<double>(t_ns - offset_ns_); }
  void see_output(std::span<const std::uint8_t> message);
  void see_event(std::span<const std::uint8_t> message);
  void see_state(std::span<const std::uint8_t> message);
  void compare(double t_world_s, const Vector& p_m, const Vector& v_m_s, double heading_rad, SeenOutput& output);

  const test::PlaneFlight& flight_;
  double t_start_s_;
  std::int64_t offset_ns_ = 0;
  double now_s_ = -1.0;
  Start start_;
  SeenFlight seen_;
};

}  // namespace plumb::faults
