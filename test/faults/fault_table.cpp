// One row per fault: what is done to the flight and when, and what it has to look like then. Expected is what whoever
// flies by the state needs; a row says why where it allows more than the bounds of judge.h.

#include "test/faults/fault_table.h"

#include <array>
#include <map>

#include "test/faults/command_faults.h"
#include "test/faults/range_faults.h"

namespace plumb::faults {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kSecond = 1'000'000'000;

/// A start in the air: the mode climbs as images and ranges prove the state. Until the scale is known well, features
/// wait for it (docs/decisions.md), and where the vehicle slows down meanwhile no range is of use for a while. So the
/// mode may go back to VIO; the state counts as recovered in either.
Words restarted(Words modes) {
  modes.insert(modes.end(), {"initialising", "inertial", "VIO", "range-VIO"});
  for (int i = 0; i < 3; ++i) modes.insert(modes.end(), {"(VIO)", "(range-VIO)"});
  return modes;
}
const Words kLost = restarted({"range-VIO", "failed"});
const Words kEither = {"range-VIO", "VIO"};
// Without images for long, no range can be of use either: it is older than the first image.
const Words kInertial = {"range-VIO", "inertial", "(VIO)", "range-VIO"};

/// After a hole in the IMU's samples nothing is known: it starts anew in the air, from images and ranges of 2 s at
/// most, after the half second for which the IMU has to be steady.
constexpr double kRestart_s = 4.0;

// What an outage of another sensor does to the rate of those that hang on it, for a second or two.
const Words kSidesOfRestart = {"IMU degraded",          "camera degraded",       "camera rejected", "camera ok",
                               "range finder degraded", "range finder rejected", "range finder ok", "image skipped"};

void add_imu_faults(std::vector<Fault>& rows) {
  const auto unit = [](World& w) -> emulator::Stim300Faults& { return w.imu().unit().faults(); };
  const Expectation lost{.modes = kLost,
                         .events = {"IMU silent", "IMU ok", "filter reset"},
                         .also = kSidesOfRestart,
                         .recovery_s = kRestart_s,
                         .recovered_in = kEither};
  rows.push_back({"imu-dead", "no byte of the IMU for 2 s", 10, 12, [=](World& w) { unit(w).unplugged = true; },
                  [=](World& w) { unit(w).unplugged = false; }, lost});
  rows.push_back({"imu-dead-for-good",
                  "no byte of the IMU any more",
                  10,
                  10,
                  [=](World& w) { unit(w).unplugged = true; },
                  nullptr,
                  {.modes = {"range-VIO", "failed"},
                   .events = {"IMU silent"},
                   .also = {"image skipped"},
                   .ending = Ending::kNotValid}});
  rows.push_back({"imu-line-gone", "reading the serial line fails for 2 s", 10, 12,
                  [](World& w) { w.imu().faults.gone = true; }, [](World& w) { w.imu().faults.gone = false; }, lost});
  rows.push_back({"imu-stuck", "the IMU repeats its last numbers for 1 s", 10, 11,
                  [=](World& w) { unit(w).stuck = true; }, [=](World& w) { unit(w).stuck = false; }, lost});
  rows.push_back({"imu-bad-status", "the IMU reports that its sensors have failed for 1 s", 10, 11,
                  [=](World& w) { unit(w).status = 0x80; }, [=](World& w) { unit(w).status = 0; }, lost});
  rows.push_back({"imu-restarted", "the IMU loses its power for a moment and starts anew", 10, 10.4,
                  [](World& w) { w.imu().unit().restart(w.now_ns()); }, nullptr, lost});
  rows.push_back({"imu-late",
                  "bytes of the IMU arrive 20 ms late for 0.2 s",
                  10,
                  10.2,
                  [=](World& w) { unit(w).late_ns = 20 * kMs; },
                  [=](World& w) { unit(w).late_ns = 0; },
                  {.also = {"image skipped"}}});
  rows.push_back(
      {"imu-late-long",
       "bytes of the IMU arrive 30 ms late for 5 s",
       10,
       15,
       [=](World& w) { unit(w).late_ns = 30 * kMs; },
       [=](World& w) { unit(w).late_ns = 0; },
       {.also = {"image skipped", "IMU degraded", "IMU ok", "camera degraded", "camera ok"}, .recovery_s = kBack_s}});
  rows.push_back({"imu-doubled",
                  "every datagram of the IMU comes twice for 5 s",
                  10,
                  15,
                  [](World& w) { w.imu().faults.doubled = true; },
                  [](World& w) { w.imu().faults.doubled = false; },
                  {}});
  rows.push_back({"imu-out-of-order",
                  "of two datagrams of the IMU the second comes first, for 5 s",
                  10,
                  15,
                  [](World& w) { w.imu().faults.swapped = true; },
                  [](World& w) { w.imu().faults.swapped = false; },
                  {.also = {"IMU degraded", "IMU ok"}, .recovery_s = kBack_s}});
  rows.push_back({"imu-corrupted",
                  "3 of 1000 bytes of the IMU have a wrong bit for 5 s",
                  10,
                  15,
                  [=](World& w) { unit(w).flipped_bit = 0.003; },
                  [=](World& w) { unit(w).flipped_bit = 0.0; },
                  {}});
  rows.push_back({"imu-bytes-lost",
                  "3 of 1000 bytes of the IMU are lost for 5 s",
                  10,
                  15,
                  [=](World& w) { unit(w).lost_byte = 0.003; },
                  [=](World& w) { unit(w).lost_byte = 0.0; },
                  {}});
  rows.push_back(
      {"imu-knocked",
       "a knock drives every accelerometer to its limits for 20 ms",
       10,
       10.02,
       [](World& w) { w.imu().faults.saturated = true; },
       [](World& w) { w.imu().faults.saturated = false; },
       {.also = {"image skipped", "IMU degraded", "IMU ok", "camera degraded", "camera ok"}, .recovery_s = kBack_s}});
  rows.push_back({"imu-saturated",
                  "a shock drives every accelerometer to its limits for 0.2 s",
                  10,
                  10.2,
                  [](World& w) { w.imu().faults.saturated = true; },
                  [](World& w) { w.imu().faults.saturated = false; },
                  {.modes = restarted({"range-VIO", "(failed)"}),
                   .events = {"filter reset"},
                   .also = {"IMU silent", "IMU ok", "IMU degraded", "camera degraded", "camera ok", "image skipped"},
                   .recovery_s = kRestart_s,
                   .recovered_in = kEither}});
}

void add_camera_faults(std::vector<Fault>& rows) {
  // Each second on the IMU alone costs position, at worst as the square of the time.
  constexpr double kTwoSeconds_m = 0.3;
  constexpr double kThreeSeconds_m = 0.5;
  const Words back = {"camera degraded", "image skipped"};
  const Expectation silent{.modes = kInertial,
                           .events = {"camera silent", "camera ok"},
                           .also = back,
                           .recovery_s = kBack_s,
                           .position_m = kTwoSeconds_m};
  Expectation long_silent = silent;
  long_silent.position_m = kThreeSeconds_m;
  // The first image after the outage shows tracks of before it, and then half a second passes until new ones are of
  // use.
  long_silent.modes.insert(long_silent.modes.end(), {"(inertial)", "(range-VIO)"});
  const Expectation rejected{.modes = kInertial,
                             .events = {"camera rejected", "camera ok"},
                             .also = back,
                             .recovery_s = kBack_s,
                             .position_m = kTwoSeconds_m};
  const auto row = [&rows](const char* name, const char* what, double from_s, double until_s, auto set,
                           const Expectation& expected) {
    rows.push_back({name, what, from_s, until_s, [set](World& w) { set(w.camera()); },
                    [](World& w) { w.camera() = {}; }, expected});
    if (until_s == from_s) rows.back().end = nullptr;
  };
  row("camera-dead", "no image for 3 s", 10, 13, [](CameraFaults& f) { f.dead = true; }, long_silent);
  row("camera-dead-for-good", "no image any more", 10, 10, [](CameraFaults& f) { f.dead = true; },
      {.modes = {"range-VIO", "inertial"}, .events = {"camera silent"}, .ending = Ending::kNotReliable});
  row(
      "camera-stuck", "the camera sends its last image again and again for 2 s", 10, 12,
      [](CameraFaults& f) { f.stuck = true; }, silent);
  row("camera-late", "images arrive 100 ms late for 3 s", 10, 13, [](CameraFaults& f) { f.late_ns = 100 * kMs; },
      {.also = {"image skipped"}, .recovery_s = 0.0});
  row("camera-doubled", "every image comes twice for 3 s", 10, 13, [](CameraFaults& f) { f.doubled = true; },
      {.same_states = true});
  row("camera-out-of-order", "of two images the second comes first, for 3 s", 10, 13,
      [](CameraFaults& f) { f.swapped = true; }, {.also = {"camera degraded", "camera ok"}, .recovery_s = 0.0});
  // Ranges are judged by features, and while those wander with the noise some ranges fit none.
  Expectation misled = rejected;
  misled.also.insert(misled.also.end(), {"range finder degraded", "range finder ok"});
  row("camera-noise", "pixels at random for 2 s", 10, 12, [](CameraFaults& f) { f.noise = true; }, misled);
  row("camera-black", "black images for 2 s", 10, 12, [](CameraFaults& f) { f.black = true; }, rejected);
  row(
      "camera-damaged", "the source says of each image that it is not whole, for 2 s", 10, 12,
      [](CameraFaults& f) { f.damaged = true; }, silent);
  row(
      "camera-wrong-size", "images of half the height for 2 s", 10, 12, [](CameraFaults& f) { f.half_size = true; },
      silent);
  row("camera-clock-ahead", "stamps of the images jump 5 s ahead, for 1 s", 10, 11,
      [](CameraFaults& f) { f.stamp_error_ns = 5 * kSecond; },
      {.modes = kInertial,
       .events = {"camera ok"},
       .also = {"camera silent", "camera rejected", "camera degraded", "image skipped"},
       .recovery_s = kBack_s,
       .position_m = kTwoSeconds_m});
  row("camera-one-bad-stamp", "one image is stamped an hour ahead", 10, 10.05,
      [](CameraFaults& f) { f.stamp_error_ns = 3600 * kSecond; }, {.also = {"image skipped"}});
  row("camera-clock-back", "stamps of the images jump 5 s back, for 1 s", 10, 11,
      [](CameraFaults& f) { f.stamp_error_ns = -5 * kSecond; },
      {.modes = kInertial,
       .events = {"camera ok"},
       .also = {"camera silent", "camera rejected", "camera degraded", "image skipped"},
       .recovery_s = kBack_s,
       .position_m = kTwoSeconds_m});
}

void add_host_faults(std::vector<Fault>& rows) {
  const Words sides = {"camera silent",       "camera degraded",       "camera rejected", "camera ok",
                       "range finder silent", "range finder degraded", "range finder ok", "image skipped",
                       "IMU degraded",        "slip of assemble",      "slip of predict", "slip of publish",
                       "slip of health"};
  rows.push_back({"clock-jump",
                  "the flight clock jumps 2 s ahead",
                  10,
                  10,
                  [](World& w) { w.step_clock(2 * kSecond); },
                  nullptr,
                  {.modes = kLost,
                   .events = {"IMU silent", "IMU ok", "filter reset"},
                   .also = sides,
                   .recovery_s = kRestart_s,
                   .recovered_in = kEither}});
  rows.push_back({"nav-overrun",
                  "an image takes the nav job 100 ms for 2 s, three times its budget",
                  10,
                  12,
                  [](World& w) { w.host().nav_time_ns = 100 * kMs; },
                  [](World& w) { w.host().nav_time_ns = 10 * kMs; },
                  {.events = {"overrun of nav", "result late", "image skipped"},
                   .also = {"camera degraded", "camera ok"},
                   .recovery_s = 0.5}});
  rows.push_back(
      {"nav-hung",
       "the nav job hangs for 2 s",
       10,
       12,
       [](World& w) { w.host().nav_hangs = true; },
       [](World& w) { w.host().nav_hangs = false; },
       {.modes = restarted({"range-VIO", "inertial"}),
        .events = {"overrun of nav", "result late", "image skipped", "frame that nav missed", "filter reset"},
        .also = sides,
        .recovery_s = kRestart_s,
        .recovered_in = kEither}});
  rows.push_back({"tick-hung",
                  "the tick hangs for 1 s; nothing of the IMU is lost",
                  10,
                  11,
                  [](World& w) { w.host().tick_hangs = true; },
                  [](World& w) { w.host().tick_hangs = false; },
                  {.modes = {"range-VIO", "failed", "range-VIO"},
                   .events = {"slip of assemble"},
                   .also = sides,
                   .recovery_s = kBack_s}});
  rows.push_back({"rings-full",
                  "the tick hangs for 3 s; the rings of IMU and images overflow",
                  10,
                  13,
                  [](World& w) { w.host().tick_hangs = true; },
                  [](World& w) { w.host().tick_hangs = false; },
                  {.modes = kLost,
                   .events = {"IMU ok", "filter reset", "slip of assemble"},
                   .also = sides,
                   .recovery_s = kRestart_s,
                   .recovered_in = kEither}});
  rows.push_back({"imu-thread-hung",
                  "the IMU's thread hangs for 1 s; the line keeps 4 KiB",
                  10,
                  11,
                  [](World& w) { w.host().imu_thread_hangs = true; },
                  [](World& w) { w.host().imu_thread_hangs = false; },
                  {.modes = kLost,
                   .events = {"IMU silent", "IMU ok", "filter reset"},
                   .also = sides,
                   .recovery_s = kRestart_s,
                   .recovered_in = kEither}});
  rows.push_back({"log-full",
                  "the disk does not answer for 5 s; the queues of the log overflow",
                  10,
                  15,
                  [](World& w) { w.host().log_hangs = true; },
                  [](World& w) { w.host().log_hangs = false; },
                  {.same_states = true, .whole_log = false}});
  add_command_faults(rows);
  rows.push_back({"reset-commanded",
                  "a reset is commanded in the air",
                  10,
                  10,
                  [](World& w) { send_command(w, 1, CommandId::kReset); },
                  nullptr,
                  {.modes = restarted({"range-VIO"}),
                   .events = {"command accepted", "filter reset"},
                   .also = sides,
                   .recovery_s = kRestart_s,
                   .recovered_in = kEither}});
}

/// What the driver of a device must notice, and tell.
void expect_counts(std::vector<Fault>& rows) {
  const std::map<std::string, Words> counts{{"imu-stuck", {"STIM300 counts stuck"}},
                                            {"imu-bad-status", {"STIM300 counts faulty"}},
                                            {"imu-restarted", {"STIM300 counts restarts"}},
                                            {"imu-doubled", {"STIM300 counts duplicates"}},
                                            {"imu-out-of-order", {"STIM300 counts missing"}},
                                            {"imu-corrupted", {"STIM300 counts checksum_errors"}},
                                            {"imu-bytes-lost", {"STIM300 counts checksum_errors"}},
                                            {"imu-knocked", {"STIM300 counts overloads"}},
                                            {"imu-saturated", {"STIM300 counts overloads"}},
                                            {"camera-stuck", {"camera counts repeated"}},
                                            {"camera-doubled", {"camera counts repeated"}},
                                            {"camera-damaged", {"camera counts damaged"}},
                                            {"camera-wrong-size", {"camera counts wrong_size"}},
                                            {"range-doubled", {"CAN range finder counts duplicates"}},
                                            {"range-corrupted", {"CAN range finder counts crc_errors"}},
                                            {"range-nan", {"CAN range finder counts malformed"}},
                                            {"lidar-lite-dead", {"LIDAR-Lite counts not_acknowledged"}},
                                            {"lidar-lite-busy", {"LIDAR-Lite counts busy_timeouts"}},
                                            {"lidar-lite-not-ready", {"LIDAR-Lite counts not_ready"}}};
  for (Fault& fault : rows) {
    if (const auto at = counts.find(fault.name); at != counts.end()) fault.expected.counts = at->second;
  }
}

}  // namespace

std::vector<Fault> flight_faults() {
  std::vector<Fault> rows;
  rows.push_back({"none", "nothing", 5, 5, nullptr, nullptr, {}});
  add_imu_faults(rows);
  add_camera_faults(rows);
  add_range_faults(rows);
  add_lidar_lite_faults(rows);
  add_host_faults(rows);
  expect_counts(rows);
  return rows;
}

}  // namespace plumb::faults
