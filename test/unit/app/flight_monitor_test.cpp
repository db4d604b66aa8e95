#include "fsw/app/flight_monitor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "test/support/property.h"

namespace plumb {
namespace {

bool same(const Event& a, const Event& b) {
  return a.id == b.id && a.severity == b.severity && a.t == b.t && a.arguments == b.arguments;
}

/// A flight in which sensors come and go, results hold and do not, the filter is reset, and commands come.
class AnyFlight {
 public:
  explicit AnyFlight(test::Generator& g) : g_(g) { input_.t = Time::from_seconds(3); }

  /// The next tick, as the monitor sees it.
  void fly(FlightMonitor& monitor, FlightMonitor& again) {
    for (bool& on : on_) on = g_.integer(0, 40) == 0 ? !on : on;
    input_.t = input_.t + Duration::from_ms(20);
    if (g_.integer(0, 2) == 0) {
      release();
      monitor.take(result_);
      again.take(result_);
    }
    SensorTick imu;
    if (on_[0]) {
      imu.samples = 1;
      ++(on_[1] ? imu.accepted : imu.refused);
      if (on_[1]) t_imu_ = input_.t;
    }
    input_.has_camera = on_[2];
    input_.range.resize(on_[3] ? 1 : 0);
    input_.commands.clear();
    if (g_.integer(0, 50) == 0) {
      Command command{.source = 1, .sequence = static_cast<std::uint32_t>(g_.bits()), .id = 2};
      command.verdict = static_cast<CommandVerdict>(g_.integer(0, 8));
      ASSERT_EQ(input_.commands.push_back(command), Status::kOk);
    }
    monitor.step(input_, {.imu = imu, .t_imu = t_imu_, .state = result_.state});
    again.step(input_, {.imu = imu, .t_imu = t_imu_, .state = result_.state});
  }

  const InputFrame& input() const { return input_; }
  const NavResult& result() const { return result_; }

 private:
  void release() {
    result_.state.t = input_.t;
    result_.state.valid = on_[4];
    if (on_[2] && on_[5]) result_.state.t_vision = input_.t;
    if (on_[3]) {
      ++(on_[6] ? result_.estimator.ranges_used : result_.estimator.ranges_gated);
      if (on_[6]) result_.state.t_range = input_.t;
    }
    if (g_.integer(0, 100) == 0) ++result_.estimator.resets;
    if (g_.integer(0, 200) == 0) ++result_.estimator.numerical_faults;
  }

  test::Generator& g_;
  std::array<bool, 7> on_{};
  InputFrame input_;
  Time t_imu_ = Time::never();
  NavResult result_;
};

// Nothing changes without an event, no event comes without a change, and the same flight is told the same.
TEST(FlightMonitorLaws, EveryChangeIsToldOnceAndTheSameInAReplay) {
  test::for_all(30, [](test::Generator& g) {
    FlightMonitor monitor({});
    FlightMonitor again({});
    AnyFlight flight(g);
    std::uint64_t told = 0;
    for (int i = 0; i < 2000; ++i) {
      const NavMode mode = monitor.mode();
      const SensorsHealth sensors = monitor.sensors();
      const std::uint64_t resets = flight.result().estimator.resets;
      flight.fly(monitor, again);
      const auto& events = monitor.events();
      ASSERT_TRUE(std::equal(events.begin(), events.end(), again.events().begin(), again.events().end(), same));
      const auto count = [&events](EventId id) {
        return std::count_if(events.begin(), events.end(), [id](const Event& event) { return event.id == id; });
      };
      std::ptrdiff_t changed = 0;
      for (std::size_t k = 0; k < sensors.size(); ++k)
        changed += monitor.sensors()[k].state != sensors[k].state ? 1 : 0;
      ASSERT_EQ(count(EventId::kModeChanged), monitor.mode() != mode ? 1 : 0);
      ASSERT_EQ(count(EventId::kSensorChanged), changed);
      ASSERT_EQ(count(EventId::kFilterReset), flight.result().estimator.resets != resets ? 1 : 0);
      ASSERT_EQ(count(EventId::kCommand), static_cast<std::ptrdiff_t>(flight.input().commands.size()));
      for (const Event& event : events) {
        ++told;
        ASSERT_EQ(event.t, flight.input().t);
        if (event.id != EventId::kModeChanged) continue;
        ASSERT_EQ(event.arguments[0], static_cast<std::int64_t>(mode));
        ASSERT_EQ(event.arguments[1], static_cast<std::int64_t>(monitor.mode()));
        ASSERT_EQ(event.severity == EventSeverity::kFailure, monitor.mode() == NavMode::kFailed);
      }
    }
    EXPECT_GT(told, 50U);
  });
}

TEST(FlightMonitor, ACameraWhoseStampsAreAheadIsRejected) {
  FlightMonitor monitor({});
  InputFrame input;
  input.t = Time::from_seconds(3);
  input.has_camera = input.image_skipped = true;
  const NavState none;
  const auto fly = [&](Duration ahead) {
    for (int i = 0; i < ModeOptions{}.rejected_after; ++i) {
      input.t = input.t + Duration::from_ms(50);
      input.camera.t_exposure_mid = input.t + ahead;
      monitor.step(input, {.imu = {.samples = 1, .accepted = 1}, .t_imu = input.t, .state = none});
    }
    return monitor.sensors()[static_cast<std::size_t>(Sensor::kCamera)].state;
  };
  EXPECT_EQ(fly(Duration::from_ms(-60)), SensorState::kOk) << "skipped because the nav job was busy";
  EXPECT_EQ(fly(Duration::from_ms(5000)), SensorState::kRejected);
}

TEST(FlightMonitor, ResetsThatWereCommandedAreNoFailure) {
  FlightMonitor monitor({});
  NavResult result;
  InputFrame input;
  input.t = Time::from_seconds(3);
  for (int i = 0; i < 100; ++i) {
    input.t = input.t + Duration::from_ms(50);
    result.state = {.t = input.t, .valid = true, .t_vision = input.t};
    ++result.estimator.resets;
    ++result.system.commanded_resets;
    monitor.take(result);
    monitor.step(input, {.imu = {.samples = 1, .accepted = 1}, .t_imu = input.t, .state = result.state});
    EXPECT_EQ(monitor.mode(), NavMode::kVio);
  }
}

}  // namespace
}  // namespace plumb
