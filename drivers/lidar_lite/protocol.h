#pragma once
// How a LIDAR-Lite is kept measuring: a state machine that asks for one transfer at a time and never waits. It knows no
// bus and no clock; device.h joins it to both.
//
//   reset -> 50 ms -> identity -> preset -> verify -> [ command -> status, until not busy -> distance -> strength ] at
//   25 Hz
//
// What goes wrong ends in a reset of the device: ten transfers in a row without an acknowledge, busy for 100 ms, twenty
// distances in a row that are zero (a known stuck state of the family), a preset that does not read back, another model
// at the address. The first reset comes at once; before each further one is a pause that doubles from 50 to 800 ms,
// until a measurement comes.

#include <cstdint>

#include "drivers/lidar_lite/capture.h"
#include "fsw/base/fault_counter.h"
#include "fsw/base/status.h"
#include "fsw/base/time.h"
#include "fsw/measurement/samples.h"

namespace plumb::lidar_lite {

struct Options {
  Model model = Model::kV3;
  Duration period = Duration::from_ms(40);  ///< between commands; at least kMinPeriod
  int bias_period = 1;  ///< every so many measurements one with bias correction, 1 to kMaxBiasPeriod
};

inline constexpr Duration kMinPeriod = Duration::from_ms(10);
inline constexpr int kMaxBiasPeriod = 100;  ///< v3 manual: at least once in 100 measurements
inline constexpr Duration kPollPeriod = Duration::from_us(1500);
/// PX4 ll40ls: busy for longer is a fault. Usual are 2 to 20 ms.
inline constexpr Duration kMaxAcquisition = Duration::from_ms(100);
/// The manual asks for 22 ms after a reset; PX4 gives 50.
inline constexpr Duration kResetPause = Duration::from_ms(50);
inline constexpr int kMaxBackOff = 5;  ///< resets until the pause before the next one is kMaxBackOffPause
inline constexpr Duration kMaxBackOffPause = kResetPause * (1 << (kMaxBackOff - 1));
inline constexpr int kMaxFailuresInARow = 10;
inline constexpr int kMaxZerosInARow = 20;

/// What the driver has met since it was made. What values mean, kLidarLiteFaults tells (fsw/events/device_faults.h).
struct Counters {
  std::uint32_t ranges = 0;
  std::uint32_t no_returns = 0;
  std::uint32_t weak = 0;
  FaultCounter not_ready;              ///< a distance with its top bit set: no sample
  std::uint32_t not_acknowledged = 0;  ///< transfers that failed; a busy device may refuse some
  FaultCounter busy_timeouts;
  FaultCounter stuck;  ///< runs of kMaxZerosInARow distances that were zero or not ready
  FaultCounter wrong_model;
  FaultCounter verify_failures;  ///< a preset that did not read back
  std::uint32_t resets = 0;      ///< that were acknowledged; the first, at start-up, included
  FaultCounter late;             ///< periods that were left out because the last measurement took too long
};

struct Request {
  enum class Kind : std::uint8_t {
    kWait = 0,  ///< nothing before wake()
    kWrite,
    kRead,
  };
  Kind kind = Kind::kWait;
  FixedVector<std::uint8_t, 2> bytes;  ///< to write
  std::uint8_t size = 0;               ///< bytes to read
};

class Protocol {
 public:
  /// Precondition: options within their limits.
  explicit Protocol(const Options& options);

  /// The transfer that is due. Unless it is kWait, complete() comes next.
  Request next(Time now);
  /// What became of it, with the bytes read, or written, and the time of the STOP (of the attempt, where it failed).
  /// Returns the sample that it completes, or kNotReady.
  Result<RangeSample> complete(const Transfer& transfer);

  /// When next() has something to do again. Never more than the longest pause after the call that set it.
  Time wake() const { return wake_; }
  bool measuring() const { return step_ >= Step::kCommand; }
  const Counters& counters() const { return counters_; }

 private:
  enum class Step : std::uint8_t { kReset = 0, kIdentity, kPreset, kVerify, kCommand, kStatus, kDistance, kStrength };

  Request read_register(std::uint8_t address, std::uint8_t size);
  void go(Step step, Time wake);
  void start_measurement(Time now);
  void reset_device(Time now);
  void on_failure(Time t);
  void on_written(Time t);
  void on_read(const Transfer& transfer);
  void on_measurement_read(const Transfer& transfer);
  Result<RangeSample> on_measurement(const Measurement& measurement, Time now);

  Options options_;
  const ModelTable& table_;
  Capture capture_;
  Counters counters_;
  Step step_ = Step::kReset;
  bool pointer_written_ = false;  ///< a register read is half done
  std::size_t preset_index_ = 0;
  Time wake_;        ///< at once
  Time t_schedule_;  ///< when the last command was due
  Time t_command_;
  std::uint64_t commands_ = 0;
  std::uint8_t status_ = 0;  ///< the last that was read
  int failures_in_a_row_ = 0;
  int zeros_in_a_row_ = 0;
  int back_off_ = 0;
};

}  // namespace plumb::lidar_lite
