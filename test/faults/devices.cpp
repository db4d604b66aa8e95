#include "test/faults/devices.h"

#include <algorithm>
#include <cerrno>
#include <limits>
#include <map>

#include "test/emulators/can_range/can_range_encoder.h"
#include "test/faults/heap_meter.h"

namespace plumb::faults {
namespace {

constexpr std::int64_t kOnBefore_ns = 2'000'000'000;

double seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

std::map<std::int64_t, std::vector<std::uint8_t>>& images_made() {
  static std::map<std::int64_t, std::vector<std::uint8_t>> made;
  return made;
}

const std::vector<std::uint8_t>& image_of(std::int64_t number) {
  auto [place, is_new] = images_made().try_emplace(number);
  if (is_new) place->second = test::PlaneFlight(0.0).image(seconds(number * SimulatedCamera::kPeriod_ns));
  return place->second;
}

}  // namespace

void forget_images() { images_made().clear(); }

SimulatedImu::SimulatedImu(const test::PlaneFlight& flight, std::int64_t t_start_ns)
    : unit_({}, t_start_ns - kOnBefore_ns, 1), t_ns_(t_start_ns) {
  unit_.set_rate([&flight](double t_s) { return flight.rate_rad_s(t_s); });
  unit_.set_specific_force([this, &flight](double t_s) {
    std::array<double, 3> force = flight.force_m_s2(t_s);
    if (faults.saturated) {
      constexpr double kShaking_m_s2 = 500.0;
      constexpr double kShakes_rad_s = 300.0;
      for (double& axis : force) axis += kShaking_m_s2 * std::sin(kShakes_rad_s * t_s);
    }
    return force;
  });
  static_cast<void>(unit_.run_until(t_start_ns));
}

void SimulatedImu::run_until(std::int64_t t_ns, Time flight_time) {
  t_ns_ = t_ns;
  flight_time_ = flight_time;
  for (const emulator::Transmission& transmission : unit_.run_until(t_ns)) {
    if (faults.swapped && held_.empty()) {
      held_ = transmission.bytes;
      continue;
    }
    put(transmission.bytes);
    if (faults.doubled) put(transmission.bytes);
    put(held_);
    held_.clear();
  }
}

void SimulatedImu::put(const emulator::Bytes& bytes) {
  for (const std::uint8_t byte : bytes) {
    if (line_.size() < kLineBuffer) line_.push_back(byte);
  }
}

Result<SerialChunk> SimulatedImu::read(std::span<std::uint8_t> buffer, Duration) {
  if (faults.gone) {
    line_.clear();
    return Status::kRejected;
  }
  if (line_.empty()) return Status::kNotReady;
  const std::size_t size = std::min(buffer.size(), line_.size());
  std::copy_n(line_.begin(), size, buffer.begin());
  line_.erase(line_.begin(), line_.begin() + static_cast<std::ptrdiff_t>(size));
  return SerialChunk{.t = flight_time_, .size = size};
}

Status SimulatedImu::write(std::span<const std::uint8_t> bytes, Duration) {
  if (faults.gone) return Status::kRejected;
  unit_.receive(bytes, t_ns_);
  return Status::kOk;
}

int SimulatedImu::last_error() const { return faults.gone ? EIO : 0; }

// A frame is there at its end, exposure and readout after its middle less half an exposure.
void SimulatedCamera::run_until(std::int64_t t_ns, Time flight_time) {
  for (;;) {
    const std::int64_t t_end_ns = t_start_ns_ + next_ * kPeriod_ns + kExposure_ns / 2 + kReadout_ns;
    if (t_end_ns > t_ns) break;
    const Shot shot = shoot(t_end_ns, flight_time + Duration::from_ns(t_end_ns - t_ns));
    ++next_;
    if (faults.dead) continue;
    if (faults.swapped && !holds_) {
      held_ = shot;
      holds_ = true;
      continue;
    }
    send(shot);
    if (faults.doubled) send(shot);
    if (holds_) send(held_);
    holds_ = false;
  }
  while (!on_the_way_.empty() && on_the_way_.front().t_arrival_ns <= t_ns) {
    arrived_.push_back(std::move(on_the_way_.front()));
    on_the_way_.pop_front();
  }
}

SimulatedCamera::Shot SimulatedCamera::shoot(std::int64_t t_end_ns, Time flight_time) {
  Shot shot;
  shot.pixels = faults.stuck && !last_.empty() ? last_ : image_of(next_);
  last_ = shot.pixels;
  if (faults.black) std::fill(shot.pixels.begin(), shot.pixels.end(), std::uint8_t{0});
  if (faults.noise) {
    for (std::uint8_t& pixel : shot.pixels) pixel = static_cast<std::uint8_t>(256.0 * dice_.uniform());
  }
  const int height = faults.half_size ? test::PlaneFlight::kHeight / 2 : test::PlaneFlight::kHeight;
  shot.frame.image = {
      .pixels = nullptr, .width = test::PlaneFlight::kWidth, .height = height, .stride = test::PlaneFlight::kWidth};
  shot.frame.t = flight_time + Duration::from_ns(faults.stamp_error_ns);
  shot.frame.stamp = CameraStamp::kEndOfFrame;
  shot.frame.sequence = static_cast<std::uint32_t>(next_);
  shot.frame.damaged = faults.damaged;
  shot.frame.has_exposure = true;
  shot.frame.exposure = {.time = Duration::from_ns(kExposure_ns), .gain = 1.0};
  shot.t_arrival_ns = t_end_ns + faults.late_ns;
  return shot;
}

void SimulatedCamera::send(const Shot& shot) { on_the_way_.push_back(shot); }

Result<PortFrame> SimulatedCamera::receive(Duration) {
  if (arrived_.empty()) return Status::kNotReady;
  taken_ = std::move(arrived_.front());
  arrived_.pop_front();
  taken_.frame.image.pixels = taken_.pixels.data();
  if (taken_.frame.damaged) health_.damaged.add(taken_.frame.sequence);
  return taken_.frame;
}

void SimulatedRange::run_until(std::int64_t t_ns, Time flight_time) {
  for (; t_next_ns_ <= t_ns; t_next_ns_ += kPeriod_ns) {
    Transfer transfer = measure(t_next_ns_);
    if (faults.dead) continue;
    if (faults.swapped && !holds_) {
      held_ = std::move(transfer);
      holds_ = true;
      continue;
    }
    on_the_way_.push_back(transfer);
    if (faults.doubled) on_the_way_.push_back(transfer);
    if (holds_) on_the_way_.push_back(held_);
    holds_ = false;
  }
  while (!on_the_way_.empty() && on_the_way_.front().t_arrival_ns <= t_ns) {
    for (const CanFrame& frame : on_the_way_.front().frames) arrived_.push_back({.t = flight_time, .frame = frame});
    on_the_way_.pop_front();
  }
}

double SimulatedRange::reading_m(std::int64_t t_ns) {
  if (faults.not_a_number) return std::numeric_limits<double>::quiet_NaN();
  if (!faults.stuck || last_m_ == 0.0) last_m_ = flight_.height_m(seconds(t_ns));
  constexpr double kWildest_m = 30.0;
  const bool wild = faults.outlier_every > 0 && count_ % static_cast<unsigned>(faults.outlier_every) == 0;
  return wild ? 0.5 + kWildest_m * dice_.uniform() : last_m_ + faults.offset_m;
}

SimulatedRange::Transfer SimulatedRange::measure(std::int64_t t_ns) {
  constexpr unsigned kValid = 1;
  constexpr unsigned kTooFar = 3;
  constexpr unsigned kTransferIds = 32;
  const unsigned number = count_++;
  Transfer transfer{.t_arrival_ns = t_ns + faults.late_ns,
                    .frames = test::measurement_frames({}, reading_m(t_ns), faults.too_far ? kTooFar : kValid,
                                                       number % kTransferIds)};
  if (!faults.corrupted) return transfer;
  for (CanFrame& frame : transfer.frames) {
    const auto bit = static_cast<unsigned>(8.0 * (frame.size - 1) * dice_.uniform());  // not in the tail byte
    frame.bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
  }
  return transfer;
}

Status SimulatedRange::set_filters(std::span<const CanFilter>) { return Status::kOk; }

Result<ReceivedCanFrame> SimulatedRange::receive(Duration) {
  if (arrived_.empty()) return Status::kNotReady;
  const ReceivedCanFrame frame = arrived_.front();
  arrived_.pop_front();
  return frame;
}

SimulatedLidarLite::SimulatedLidarLite(const test::PlaneFlight& flight) {
  unit_.set_motion([&flight](std::int64_t t_ns) { return flight.height_m(seconds(t_ns)); });
}

void SimulatedLidarLite::run_until(std::int64_t t_ns, Time flight_time) {
  t_ns_ = t_ns;
  flight_time_ = flight_time;
}

Result<Time> SimulatedLidarLite::write(std::uint8_t address, std::span<const std::uint8_t> bytes) {
  const TestScope scope;
  if (unit_.write(address, bytes, t_ns_)) return flight_time_;
  return Status::kRejected;
}

Result<Time> SimulatedLidarLite::read(std::uint8_t address, std::span<std::uint8_t> bytes) {
  const TestScope scope;
  if (unit_.read(address, bytes, t_ns_)) return flight_time_;
  return Status::kRejected;
}

int SimulatedLidarLite::last_error() const { return ENXIO; }

}  // namespace plumb::faults
