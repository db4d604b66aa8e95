#pragma once
// What the navigation rests on, and whether it is of use, as a state machine over facts of logical time. So a replay of
// the same input frames goes through the same modes.

#include <array>
#include <cstdint>

#include "fsw/base/fixed_vector.h"
#include "fsw/base/time.h"
#include "fsw/measurement/nav_state.h"
#include "fsw/modes/options.h"
#include "fsw/modes/state_table.h"

namespace plumb {

namespace mode_condition {
inline constexpr ConditionSet kState = 1U << 0;
inline constexpr ConditionSet kImageOld = 1U << 1;
inline constexpr ConditionSet kRangeOld = 1U << 2;
inline constexpr ConditionSet kImuSilent = 1U << 3;
inline constexpr ConditionSet kImuUnsteady = 1U << 4;
inline constexpr ConditionSet kResetStorm = 1U << 5;
inline constexpr ConditionSet kFaultStands = 1U << 6;
inline constexpr ConditionSet kAll = (1U << 7) - 1U;
inline constexpr ConditionSet kFailure = kImuSilent | kResetStorm | kFaultStands;
}  // namespace mode_condition

/// By bit.
inline constexpr std::array<ConditionText, 7> kModeConditions{{
    {"a state", "the output has one"},
    {"image old", "no image held the state for `modes.image_timeout`, by its features or by showing a standstill"},
    {"range old", "no range was of use for `modes.range_timeout`"},
    {"IMU silent", "no sample for `modes.imu_timeout`; at first `modes.start_time`"},
    {"IMU unsteady", "`modes.steady` without a hole are not over"},
    {"reset storm", "`modes.max_resets` resets that nobody commanded within `modes.reset_window`"},
    {"fault stands", "a numerical fault, and no state for `modes.fault_recovery` since"},
}};

inline constexpr std::array<StateRow<NavMode>, 5> kModeTable{{
    {.state = NavMode::kFailed,
     .name = "failed",
     .enter = {.any_of = mode_condition::kFailure},
     .stay = {.any_of = mode_condition::kFailure | mode_condition::kImuUnsteady}},
    {.state = NavMode::kInitialising,
     .name = "initialising",
     .enter = {.none_of = mode_condition::kState},
     .stay = {.none_of = mode_condition::kState | mode_condition::kFailure}},
    {.state = NavMode::kRangeVio,
     .name = "range-VIO",
     .enter = {.all_of = mode_condition::kState, .none_of = mode_condition::kImageOld | mode_condition::kRangeOld},
     .stay = {.all_of = mode_condition::kState,
              .none_of = mode_condition::kImageOld | mode_condition::kRangeOld | mode_condition::kFailure}},
    {.state = NavMode::kVio,
     .name = "VIO",
     .enter = {.all_of = mode_condition::kState | mode_condition::kRangeOld, .none_of = mode_condition::kImageOld},
     .stay = {.all_of = mode_condition::kState | mode_condition::kRangeOld,
              .none_of = mode_condition::kImageOld | mode_condition::kFailure}},
    {.state = NavMode::kInertial,
     .name = "inertial",
     .enter = {.all_of = mode_condition::kState | mode_condition::kImageOld},
     .stay = {.all_of = mode_condition::kState | mode_condition::kImageOld, .none_of = mode_condition::kFailure}},
}};
static_assert(is_sound(kModeTable, mode_condition::kAll));

/// At the end of a tick.
struct ModeFacts {
  Time t;
  bool has_state = false;              ///< of the output
  Time t_imu = Time::never();          ///< newest sample of use
  Time t_vision = Time::never();       ///< as in NavState, of the newest result
  Time t_range = Time::never();        ///< likewise
  std::uint64_t resets = 0;            ///< of the filter since start-up, those commanded apart
  std::uint64_t numerical_faults = 0;  ///< since start-up
};

/// The mode of an estimate at its image, where neither holes nor faults are known of.
NavMode mode_at_image(const NavState& state, const ModeOptions& options);

class ModeMachine {
 public:
  /// Resets that can be counted within the window.
  static constexpr std::size_t kMaxResets = 16;

  explicit ModeMachine(const ModeOptions& options) : options_(options) {}
  /// Other options from the next step on.
  void use(const ModeOptions& options) { options_ = options; }

  /// Precondition: time and totals do not go back.
  NavMode step(const ModeFacts& facts);

  NavMode mode() const { return mode_; }
  /// What held at the newest step.
  ConditionSet conditions() const { return conditions_; }

 private:
  void remember(const ModeFacts& facts);
  bool is_silent(const ModeFacts& facts) const;
  bool is_reset_storm(Time t) const;

  ModeOptions options_;
  NavMode mode_ = NavMode::kInitialising;
  ConditionSet conditions_ = 0;
  ModeFacts last_;
  Time t_start_ = Time::never();
  Time t_steady_since_ = Time::never();  ///< first sample after the newest hole in the IMU's
  Time t_fault_ = Time::never();         ///< the newest numerical fault, while there was no state since
  FixedVector<Time, kMaxResets> resets_;
};

}  // namespace plumb
