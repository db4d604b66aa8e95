#include "fsw/modes/mode_machine.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "test/support/property.h"

namespace plumb {
namespace {

/// A flight of 250 ticks a second in which everything is well, but for what a test takes away.
class ModeMachineTest : public ::testing::Test {
 protected:
  static constexpr Duration kTick = Duration::from_ms(4);

  /// Flies on; `change` may spoil the facts of each tick.
  template <class Change>
  NavMode fly(double length_s, Change change) {
    for (double end_s = t_s() + length_s; t_s() < end_s;) {
      facts_.t = facts_.t + kTick;
      facts_.has_state = true;
      facts_.t_imu = facts_.t_vision = facts_.t_range = facts_.t;
      change(facts_);
      if (keeps_imu_) facts_.t_imu = t_imu_;
      t_imu_ = facts_.t_imu;
      machine_.step(facts_);
    }
    return machine_.mode();
  }
  NavMode fly(double length_s) {
    return fly(length_s, [](ModeFacts&) {});
  }
  double t_s() const { return facts_.t.seconds(); }

  ModeOptions options_;
  ModeMachine machine_{options_};
  ModeFacts facts_{.t = Time::from_seconds(100)};
  bool keeps_imu_ = false;  ///< no new sample
  Time t_imu_ = Time::never();
};

TEST_F(ModeMachineTest, BeginsWithoutAStateAndEndsWithAllSensors) {
  EXPECT_EQ(machine_.mode(), NavMode::kInitialising);
  EXPECT_EQ(fly(1.0, [](ModeFacts& f) { f.has_state = false; }), NavMode::kInitialising);
  EXPECT_EQ(fly(0.1), NavMode::kRangeVio);
}

TEST_F(ModeMachineTest, RestsOnWhatWasOfUseOfLate) {
  fly(1.0);
  const Time lost = facts_.t;
  const auto without_ranges = [lost](ModeFacts& f) { f.t_range = lost; };
  EXPECT_EQ(fly(options_.range_timeout_s - 0.01, without_ranges), NavMode::kRangeVio);
  EXPECT_EQ(fly(0.02, without_ranges), NavMode::kVio);
  const Time dark = facts_.t;
  const auto in_the_dark = [dark](ModeFacts& f) { f.t_vision = f.t_range = dark; };
  EXPECT_EQ(fly(options_.image_timeout_s + 0.01, in_the_dark), NavMode::kInertial);
  EXPECT_EQ(fly(0.01, without_ranges), NavMode::kVio);
  EXPECT_EQ(fly(0.01), NavMode::kRangeVio);
  EXPECT_EQ(fly(0.01, [](ModeFacts& f) { f.has_state = false; }), NavMode::kInitialising);
}

TEST_F(ModeMachineTest, FailsWithoutAnImuUntilItHasBeenSteadyForAWhile) {
  fly(1.0);
  keeps_imu_ = true;
  EXPECT_EQ(fly(options_.imu_timeout_s - 0.01), NavMode::kRangeVio);
  EXPECT_EQ(fly(0.02), NavMode::kFailed);
  keeps_imu_ = false;
  EXPECT_EQ(fly(options_.steady_s - 0.01), NavMode::kFailed);
  EXPECT_EQ(fly(0.02), NavMode::kRangeVio);
}

TEST_F(ModeMachineTest, AnImuMayTakeItsTimeToStartButNotForEver) {
  keeps_imu_ = true;
  const auto nothing = [](ModeFacts& f) { f.has_state = false; };
  EXPECT_EQ(fly(options_.start_time_s - 0.1, nothing), NavMode::kInitialising);
  EXPECT_EQ(fly(0.2, nothing), NavMode::kFailed);
}

TEST_F(ModeMachineTest, ResetsInQuickSuccessionAreAFailureWhileTheyAreRecent) {
  fly(1.0);
  facts_.resets = static_cast<std::uint64_t>(options_.max_resets) - 1;
  EXPECT_EQ(fly(1.0), NavMode::kRangeVio);
  ++facts_.resets;
  EXPECT_EQ(fly(options_.reset_window_s - 1.1), NavMode::kFailed);
  EXPECT_EQ(fly(0.2), NavMode::kRangeVio) << "the first ones are no longer within the window";
  ++facts_.resets;
  EXPECT_EQ(fly(0.1), NavMode::kRangeVio);
}

TEST_F(ModeMachineTest, ResetsThatAreFarBetweenAreNoFailure) {
  for (int i = 0; i < 20; ++i) {
    ++facts_.resets;
    EXPECT_EQ(fly(options_.reset_window_s / (options_.max_resets - 1) + 0.1), NavMode::kRangeVio);
  }
}

TEST_F(ModeMachineTest, ANumericalFaultIsAFailureWhenNoStateComesOfIt) {
  fly(1.0);
  const auto nothing = [](ModeFacts& f) { f.has_state = false; };
  ++facts_.numerical_faults;
  EXPECT_EQ(fly(options_.fault_recovery_s - 0.1, nothing), NavMode::kInitialising);
  EXPECT_EQ(fly(0.1), NavMode::kRangeVio) << "recovered in time";
  ++facts_.numerical_faults;
  EXPECT_EQ(fly(options_.fault_recovery_s + 0.1, nothing), NavMode::kFailed);
  EXPECT_EQ(fly(0.1), NavMode::kRangeVio) << "recovered at last";
}

/// Facts of a flight in which anything happens at any time.
std::vector<ModeFacts> any_flight(test::Generator& g) {
  std::vector<ModeFacts> flight;
  ModeFacts facts{.t = Time::from_seconds(1)};
  std::array<bool, 4> on{};
  for (int i = 0; i < 3000; ++i) {
    facts.t = facts.t + Duration::from_ms(g.integer(1, 30));
    for (bool& switched : on) switched = g.integer(0, 60) == 0 ? !switched : switched;
    facts.has_state = on[0];
    if (on[1]) facts.t_imu = facts.t;
    if (on[2]) facts.t_vision = facts.t;
    if (on[3]) facts.t_range = facts.t;
    if (g.integer(0, 200) == 0) ++facts.resets;
    if (g.integer(0, 400) == 0) ++facts.numerical_faults;
    flight.push_back(facts);
  }
  return flight;
}

// The same facts give the same modes; every row is entered and left; a mode lasts as its row says and no longer.
TEST(ModeLaws, HoldWhateverHappens) {
  std::set<NavMode> entered;
  std::set<NavMode> left;
  test::for_all(30, [&](test::Generator& g) {
    ModeMachine machine({});
    ModeMachine again({});
    for (const ModeFacts& facts : any_flight(g)) {
      const NavMode before = machine.mode();
      const NavMode now = machine.step(facts);
      ASSERT_EQ(again.step(facts), now);
      const ConditionSet conditions = machine.conditions();
      for (const StateRow<NavMode>& row : kModeTable) {
        if (row.state == before) {
          ASSERT_EQ(now == before, row.stay.holds(conditions) || entered_state(kModeTable, conditions) == before);
        }
        if (row.state == now && now != before) {
          ASSERT_TRUE(row.enter.holds(conditions));
        }
      }
      if (now == before) continue;
      entered.insert(now);
      left.insert(before);
      ASSERT_TRUE(facts.has_state || now == NavMode::kFailed || now == NavMode::kInitialising);
    }
  });
  EXPECT_EQ(entered.size(), kModeTable.size());
  EXPECT_EQ(left.size(), kModeTable.size());
}

TEST(ModeLaws, TheTextsNameEveryConditionAndStateOnce) {
  std::set<std::string_view> names;
  for (const ConditionText& text : kModeConditions) names.insert(text.name);
  for (const StateRow<NavMode>& row : kModeTable) names.insert(row.name);
  EXPECT_EQ(names.size(), kModeConditions.size() + kModeTable.size());
  EXPECT_EQ((1U << kModeConditions.size()) - 1U, mode_condition::kAll);
}

constexpr StateRow<int> kLasting{.state = 0, .name = "lasting", .enter = {.all_of = 1}, .stay = {}};
constexpr StateRow<int> kOther{.state = 1, .name = "other", .enter = {.none_of = 1}, .stay = {.none_of = 1}};

TEST(StateTable, KnowsWhatIsUnsound) {
  constexpr std::array<StateRow<int>, 2> kSound{kOther, kLasting};
  EXPECT_FALSE(is_sound(kSound, 1)) << "the second lasts where the first wants in";
  constexpr std::array<StateRow<int>, 2> kTurned{kLasting, kOther};
  EXPECT_TRUE(is_sound(kTurned, 1));
  EXPECT_FALSE(is_sound(std::array{kLasting}, 1)) << "nothing can be entered without the condition";
  constexpr StateRow<int> kFleeting{.state = 2, .name = "fleeting", .enter = {}, .stay = {.all_of = 1}};
  EXPECT_FALSE(is_sound(std::array{kFleeting}, 1)) << "it is left at once";
}

TEST(ModeAtImage, IsThatOfTheTable) {
  NavState state;
  state.t = Time::from_seconds(50);
  EXPECT_EQ(mode_at_image(state, {}), NavMode::kInitialising);
  state.valid = true;
  EXPECT_EQ(mode_at_image(state, {}), NavMode::kInertial);
  state.t_vision = state.t;
  EXPECT_EQ(mode_at_image(state, {}), NavMode::kVio);
  state.t_range = state.t;
  EXPECT_EQ(mode_at_image(state, {}), NavMode::kRangeVio);
}

}  // namespace
}  // namespace plumb
