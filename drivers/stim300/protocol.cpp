#include "drivers/stim300/protocol.h"

#include <algorithm>
#include <array>

namespace plumb::stim300 {
namespace {

Duration wire_time(std::size_t bytes, std::uint32_t baud) {
  return Duration::from_ns(static_cast<std::int64_t>(bytes) * kBitsPerByte * kNsPerSecond / baud);
}

std::array<double, 3> scaled(const Cluster& cluster, double scale) {
  return {cluster.raw[0] * scale, cluster.raw[1] * scale, cluster.raw[2] * scale};
}

}  // namespace

Protocol::Protocol(const Settings& expected)
    : expected_(expected), actual_(expected), aligner_(gyro_delay(expected), accel_delay(expected)) {
  PLUMB_ASSERT(is_usable(expected));
  PLUMB_ASSERT(expected.baud != 0);
}

void Protocol::feed(std::span<const std::uint8_t> bytes, Time t, Samples& samples) {
  PLUMB_ASSERT(bytes.size() <= kMaxChunkBytes);
  samples.clear();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    framer_.push(bytes[i], t - wire_time(bytes.size() - 1 - i, expected_.baud));
    Frame frame;
    while (framer_.next(frame)) {  // each takes bytes out of the framer, which holds few
      const Kind kind = layout_of(frame.bytes[0]).kind;
      if (kind == Kind::kNormal) {
        const Result<ImuSample> sample = on_normal(frame);
        if (sample) PLUMB_ASSERT(ok(samples.push_back(*sample)));
      } else if (kind == Kind::kConfiguration) {
        on_configuration(frame.bytes);
      } else if (kind == Kind::kPartNumber) {  // never asked for, so the unit has just begun
        ++counters_.restarts;
        clock_.restart();
      }
    }
  }
  if (bytes.size() < kMaxChunkBytes) t_silent_ = t;
}

void Protocol::on_configuration(std::span<const std::uint8_t> bytes) {
  differences_.clear();
  state_ = State::kRefused;
  const Result<Settings> told = decode_configuration(bytes);
  if (!told) return;
  differences_ = stim300::differences(expected_, *told);
  Settings settings = *told;
  if (settings.accel_range_g == 0) settings.accel_range_g = expected_.accel_range_g;
  if (!differences_.empty() || !is_usable(settings)) return;
  actual_ = settings;
  state_ = State::kConfigured;
}

Result<ImuSample> Protocol::on_normal(const Frame& frame) {
  const Result<Datagram> decoded = decode(frame.bytes);
  PLUMB_ASSERT(decoded.has_value());  // the framer has checked it
  const Datagram& datagram = *decoded;
  const Time t_first_byte = frame.t_end - wire_time(frame.bytes.size(), expected_.baud);
  const SampleClock::Tick tick =
      clock_.update(datagram.counter, t_first_byte - Duration::from_us(datagram.latency_us), t_silent_);
  if (!tick.first && tick.elapsed == 0) {
    counters_.duplicates.add(datagram.counter);
    return Status::kRejected;
  }
  if (!tick.first) count_step(tick.elapsed);
  t_unit_ = t_unit_ + (tick.first ? DelayAligner::kMaxGap * 2 : kInternalPeriod * tick.elapsed);
  if (!is_usable_datagram(datagram, tick.t)) return Status::kRejected;
  // The clock steps back when it learns that what it went by was late.
  if (tick.t <= t_last_reading_) {
    counters_.out_of_order.add((t_last_reading_ - tick.t).ns());
    return Status::kOutOfOrder;
  }
  t_last_reading_ = tick.t;
  const Result<ImuSample> sample =
      aligner_.push({.t = tick.t,
                     .gyro_rad_s = scaled(datagram[ClusterId::kGyro], gyro_scale_rad_s(actual_)),
                     .accel_m_s2 = scaled(datagram[ClusterId::kAccel], accel_scale_m_s2(actual_))},
                    t_unit_);
  if (!sample) {
    counters_.unaligned.add(datagram.counter);
    return sample;
  }
  ++counters_.samples;
  return sample;
}

void Protocol::count_step(std::int64_t elapsed) {
  const std::int64_t step = kInternalRate_hz / actual_.rate_hz;
  if (elapsed % step != 0) counters_.slips.add(elapsed);
  if (elapsed > step) counters_.missing.add(elapsed, static_cast<std::uint64_t>(elapsed / step - 1));
}

bool Protocol::is_usable_datagram(const Datagram& datagram, Time t) {
  if (state_ != State::kConfigured) {
    counters_.unconfigured.add(static_cast<std::int64_t>(differences_.size()));
    return false;
  }
  const unsigned gyro = datagram[ClusterId::kGyro].status;
  const unsigned accel = datagram[ClusterId::kAccel].status;
  const unsigned status = gyro | accel;
  const std::int64_t both = gyro << 8U | accel;
  if ((status & kStatusStarting) != 0) {
    counters_.starting.add(both);
    return false;
  }
  if ((status & (kStatusIntegrity | kStatusChannel)) != 0 || !datagram.layout.has(ClusterId::kAccel)) {
    counters_.faulty.add(both);
    return false;
  }
  if (is_stuck(datagram)) {
    counters_.stuck.add(datagram[ClusterId::kGyro].raw[0]);
    return false;
  }
  if (is_overloaded(status, t)) {
    counters_.overloads.add(both);
    return false;
  }
  if ((status & kStatusCondition) != 0) counters_.conditions.add(both);
  return true;
}

bool Protocol::is_overloaded(unsigned status, Time t) {
  const bool calm = t_overload_ == Time::never() || t - t_overload_ > kCalm;
  if ((status & kStatusOverload) == 0) return !calm && overloads_ >= kShock;
  overloads_ = calm ? 1 : overloads_ + 1;
  t_overload_ = t;
  return true;
}

bool Protocol::is_stuck(const Datagram& datagram) {
  const bool same =
      datagram[ClusterId::kGyro].raw == last_gyro_.raw && datagram[ClusterId::kAccel].raw == last_accel_.raw;
  last_gyro_ = datagram[ClusterId::kGyro];
  last_accel_ = datagram[ClusterId::kAccel];
  repeats_ = same ? std::min(repeats_ + 1, kMaxRepeats) : 0;
  return repeats_ == kMaxRepeats;
}

}  // namespace plumb::stim300
