#include "test/faults/range_faults.h"

namespace plumb::faults {
namespace {

constexpr std::int64_t kMs = 1'000'000;
const Words kVio = {"range-VIO", "VIO", "range-VIO"};
/// The pause before the next reset of a LIDAR-Lite that did not come back after several.
constexpr double kLidarLiteBack_s = 0.8;

}  // namespace

void add_range_faults(std::vector<Fault>& rows) {
  // Camera and IMU hold the position for some seconds, as the vehicle accelerates.
  const Words back = {"range finder degraded"};
  const Expectation silent{
      .modes = kVio, .events = {"range finder silent", "range finder ok"}, .also = back, .recovery_s = kBack_s};
  const Expectation rejected{
      .modes = kVio, .events = {"range finder rejected", "range finder ok"}, .also = back, .recovery_s = kBack_s};
  const auto row = [&rows](const char* name, const char* what, double from_s, double until_s, auto set,
                           const Expectation& expected) {
    rows.push_back(
        {name, what, from_s, until_s, [set](World& w) { set(w.range()); }, [](World& w) { w.range() = {}; }, expected});
    if (until_s == from_s) rows.back().end = nullptr;
  };
  row("range-dead", "no range for 3 s", 10, 13, [](RangeFaults& f) { f.dead = true; }, silent);
  row("range-dead-for-good", "no range any more", 10, 10, [](RangeFaults& f) { f.dead = true; },
      {.modes = {"range-VIO", "VIO"},
       .events = {"range finder silent"},
       .also = back,
       .recovery_s = 2.5,  // the timeout, and half a second for which a track carries the last range
       .position_m = 2 * kPosition_m});
  // Nothing tells it from a flight over ground that rises with the vehicle but tracks of the same spot, and those that
  // take its ranges weigh too little to refuse them. So it need not be noticed, but it must do no harm.
  row("range-stuck", "the last range again and again for 3 s, while the height changes by half a metre", 8, 11,
      [](RangeFaults& f) { f.stuck = true; },
      {.modes = {"range-VIO", "(VIO)", "(range-VIO)"},
       .also = {"range finder rejected", "range finder degraded", "range finder ok"},
       .recovery_s = kBack_s});
  row("range-late", "ranges come, and are stamped, 100 ms late for 3 s", 10, 13,
      [](RangeFaults& f) { f.late_ns = 100 * kMs; }, {});
  row("range-doubled", "every range comes twice for 3 s", 10, 13, [](RangeFaults& f) { f.doubled = true; },
      {.same_states = true});
  row("range-out-of-order", "of two ranges the second comes first, for 3 s", 10, 13,
      [](RangeFaults& f) { f.swapped = true; }, {});
  row(
      "range-corrupted", "a wrong bit in every CAN frame for 3 s", 10, 13, [](RangeFaults& f) { f.corrupted = true; },
      silent);
  row(
      "range-nan", "the range finder sends not-a-number for 3 s", 10, 13, [](RangeFaults& f) { f.not_a_number = true; },
      silent);
  row(
      "range-no-echo", "the range finder says for 3 s that it has no echo", 10, 13,
      [](RangeFaults& f) { f.too_far = true; }, rejected);
  row("range-outliers", "every third range is anything up to 30 m, for 5 s", 10, 15,
      [](RangeFaults& f) { f.outlier_every = 3; },
      {.events = {"range finder degraded", "range finder ok"}, .recovery_s = 0.0});
  row(
      "range-offset", "every range is 1 m too long for 3 s", 10, 13, [](RangeFaults& f) { f.offset_m = 1.0; },
      rejected);
}

void add_lidar_lite_faults(std::vector<Fault>& rows) {
  using UnitWorld = test::LidarLiteEmulator::World;
  const auto row = [&rows](const char* name, const char* what, auto set, const char* condition) {
    rows.push_back({.name = name,
                    .what = what,
                    .from_s = 10,
                    .until_s = 13,
                    .begin = [set](World& w) { set(w.lidar_lite().world); },
                    .end = [](World& w) { w.lidar_lite().world = {}; },
                    .expected = {.modes = kVio,
                                 .events = {condition, "range finder ok"},
                                 .also = {"range finder degraded"},
                                 .recovery_s = kBack_s + kLidarLiteBack_s},
                    .range_finder = RangeFinder::kLidarLite});
  };
  const char* const silent = "range finder silent";
  row("lidar-lite-dead", "the LIDAR-Lite acknowledges nothing for 3 s", [](UnitWorld& u) { u.dead = true; }, silent);
  row(
      "lidar-lite-busy", "an acquisition of the LIDAR-Lite does not end, for 3 s",
      [](UnitWorld& u) { u.stuck_busy = true; }, silent);
  row(
      "lidar-lite-not-ready", "the LIDAR-Lite says for 3 s that its distances are not ready",
      [](UnitWorld& u) { u.not_ready = true; }, silent);
  row(
      "lidar-lite-weak", "the echoes of the LIDAR-Lite are too weak for 3 s", [](UnitWorld& u) { u.strength = 10; },
      "range finder rejected");
}

}  // namespace plumb::faults
