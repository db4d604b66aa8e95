#include "test/emulators/can_range/can_range_emulator.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace plumb::test {
namespace {

constexpr unsigned kTransferIds = 32;
constexpr unsigned kStrength = 500;
constexpr unsigned kFar_cm = 18'000;  // what a Benewake says without a return
enum ReadingType : unsigned { kValid = 1, kTooClose, kTooFar };

}  // namespace

std::vector<CanTransmission> CanRangeEmulator::run_until(std::int64_t t_ns) {
  for (; t_next_ns_ <= t_ns; t_next_ns_ += kPeriod_ns) measure(t_next_ns_);
  std::vector<CanTransmission> ended;
  for (; !on_the_way_.empty() && on_the_way_.front().t_end_ns <= t_ns; on_the_way_.pop_front()) {
    ended.push_back(on_the_way_.front());
  }
  return ended;
}

void CanRangeEmulator::measure(std::int64_t t_ns) {
  if (!faults_.stuck) last_m_ = range_at_ ? range_at_(t_ns) : std::nullopt;
  const std::vector<CanFrame> frames = frames_of(last_m_, t_ns);
  if (faults_.silent) return;
  std::int64_t t_end_ns = std::max(t_ns + kLatency_ns + faults_.late_ns, t_bus_free_ns_);
  for (CanFrame frame : frames) {
    const int times = happens(faults_.lost_frame) ? 0 : happens(faults_.doubled_frame) ? 2 : 1;
    if (happens(faults_.flipped_bit)) {
      const auto bit = static_cast<unsigned>(random_() % (8U * frame.size));
      frame.bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    }
    for (int i = 0; i < times; ++i) {
      t_end_ns += time_on_bus_ns(frame);
      on_the_way_.push_back({.t_end_ns = t_end_ns, .frame = frame});
    }
  }
  t_bus_free_ns_ = t_end_ns;
}

std::vector<CanFrame> CanRangeEmulator::frames_of(std::optional<double> range_m, std::int64_t t_ns) {
  if (kind_ == Kind::kDronecan) {
    unsigned type = kValid;
    if (!range_m || *range_m > kFarthest_m) type = kTooFar;
    if (range_m && *range_m < kNearest_m) type = kTooClose;
    const double told_m =
        faults_.not_a_number ? std::numeric_limits<double>::quiet_NaN() : range_m.value_or(kFarthest_m);
    return measurement_frames(sensor_, told_m, type, transfer_++ % kTransferIds);
  }
  const bool seen = range_m && *range_m >= kNearest_m && *range_m < kFarthest_m;
  const unsigned distance_cm = seen ? static_cast<unsigned>(std::lround(*range_m * 100.0)) : kFar_cm;
  if (kind_ == Kind::kTf03) return {benewake_frame(distance_cm, kStrength)};
  return {benewake_frame(distance_cm, kStrength, static_cast<std::uint32_t>(t_ns / 1'000'000))};
}

// Without stuff bits: start, identifier and control, data, checksum, acknowledge, end and the pause after it.
std::int64_t CanRangeEmulator::time_on_bus_ns(const CanFrame& frame) const {
  const std::int64_t header = frame.is_extended ? 1 + 32 + 6 : 1 + 12 + 6;
  return (header + 8 * frame.size + 16 + 2 + 7 + 3) * 1'000'000'000 / bits_s_;
}

bool CanRangeEmulator::happens(double probability) {
  return std::uniform_real_distribution<double>()(random_) < probability;
}

}  // namespace plumb::test
