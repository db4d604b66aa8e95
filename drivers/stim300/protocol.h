#pragma once
// Bytes of a STIM300 to inertial samples. It knows no line and no clock of its own; device.h joins it to both.
//
// Nothing is a sample until the unit has told how it is set up, and this fits what the flight expects: with another
// range, unit or filter every number would be wrong and look right. What is not a sample is counted, by reason.

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/stim300/configuration.h"
#include "drivers/stim300/datagram.h"
#include "drivers/stim300/delay_aligner.h"
#include "drivers/stim300/framer.h"
#include "drivers/stim300/sample_clock.h"
#include "fsw/base/fault_counter.h"
#include "fsw/base/fixed_vector.h"
#include "fsw/measurement/samples.h"

namespace plumb::stim300 {

/// What became of the normal datagrams, since the protocol was made. FramerCounters has what was no datagram. What
/// their values mean, kStim300Faults tells (fsw/events/device_faults.h).
struct Counters {
  std::uint64_t samples = 0;
  // Reasons for which a datagram became no sample, in the order in which they are asked for:
  FaultCounter duplicates;    ///< its counter did not move
  FaultCounter unconfigured;  ///< the configuration is not known yet, or refused
  FaultCounter starting;      ///< the start-up bit was set, as it is for the first seconds after power-on
  FaultCounter faulty;        ///< an integrity or channel error of gyros or accelerometers, or no accelerometer sent
  FaultCounter stuck;         ///< all six numbers the same for kMaxRepeats datagrams and longer
  /// An axis was beyond its range, or has been within kCalm several times: see kShock.
  FaultCounter overloads;
  FaultCounter unaligned;     ///< not enough was remembered to join the two sensors: the first after a gap
  FaultCounter out_of_order;  ///< stamped at or before the last sample
  FaultCounter conditions;    ///< samples that were used all the same: outside operating conditions
  // What the counter tells:
  FaultCounter missing;        ///< datagrams that never came, those replaced by special ones included
  FaultCounter slips;          ///< steps of the counter that are no whole number of datagrams
  std::uint64_t restarts = 0;  ///< the unit was switched on or reset: it told its part number
};

enum class State : std::uint8_t {
  kUnconfigured = 0,  ///< the unit has not told its configuration yet
  kConfigured,        ///< it is as expected
  kRefused,           ///< it is not: see differences()
};

inline constexpr std::size_t kMaxChunkBytes = 256;  ///< 3 ms of a line at 921600 bit/s
/// No more datagrams than that end in one chunk, with what the framer had kept back from chunks before.
using Samples = FixedVector<ImuSample, (kMaxChunkBytes + kMaxDatagramBytes) / kMinDatagramBytes + 1>;
/// The noise of this unit moves a number by hundreds of counts, so six that repeat are not measured.
inline constexpr int kMaxRepeats = 8;

/// How far an axis was beyond its range nobody knows. One or two such datagrams are a hole of a few milliseconds,
/// which passes for none; kShock of them leave a velocity that is wrong by metres a second. Then nothing is a sample
/// until kCalm has passed without another: a hole long enough for the filter to see one and to be as unsure as it
/// should, and after a moment's knock short enough to be bridged (imu.max_gap). A longer shock makes it longer than
/// that, and the filter starts anew.
inline constexpr int kShock = 3;
inline constexpr Duration kCalm = Duration::from_ms(80);

class Protocol {
 public:
  /// `expected.baud` is the speed of the line. Precondition: is_usable(expected), and baud is not 0.
  explicit Protocol(const Settings& expected);

  /// Takes what one read of the line returned, the last byte having arrived at `t`, and replaces `samples` by those it
  /// completes. A read that returned less than kMaxChunkBytes, or nothing, says that the line had no more at that time.
  /// Precondition: at most kMaxChunkBytes.
  void feed(std::span<const std::uint8_t> bytes, Time t, Samples& samples);

  State state() const { return state_; }
  /// Where the unit is set up otherwise than expected. Empty although the state is kRefused: it has a code or a mix of
  /// axes that this driver does not know, or its line is too slow for its datagrams.
  const Differences& differences() const { return differences_; }
  const Counters& counters() const { return counters_; }
  const FramerCounters& framer() const { return framer_.counters(); }
  const SampleClock& clock() const { return clock_; }

 private:
  void on_configuration(std::span<const std::uint8_t> bytes);
  Result<ImuSample> on_normal(const Frame& frame);
  void count_step(std::int64_t elapsed);
  bool is_usable_datagram(const Datagram& datagram, Time t);
  bool is_overloaded(unsigned status, Time t);
  bool is_stuck(const Datagram& datagram);

  Settings expected_;
  Settings actual_;
  State state_ = State::kUnconfigured;
  Differences differences_;
  Framer framer_;
  SampleClock clock_;
  DelayAligner aligner_;
  Cluster last_gyro_;
  Cluster last_accel_;
  int repeats_ = 0;
  int overloads_ = 0;  ///< with less than kCalm between them
  Time t_overload_ = Time::never();
  Time t_last_reading_ = Time::never();
  Time t_unit_ = Time::from_ns(0);  ///< by its counter, from any zero; more than a gap on where that began anew
  Time t_silent_ = Time::never();
  Counters counters_;
};

}  // namespace plumb::stim300
