#include "test/emulators/stim300/stim300_emulator.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace plumb::emulator {
namespace {

constexpr double kGravity = 9.80665;
constexpr double kInternalRate = 2000.0;
constexpr std::int64_t kLatency_ns = 506'000;
constexpr std::int64_t kFirstSpecial_ns = 100'000'000;

// Section 7.5.2.2: group delay [ms] at 16, 33, 66, 131, 262 Hz.
constexpr std::array<double, 5> kGyroDelay_ms = {24.7, 12.7, 6.7, 3.7, 2.2};
constexpr std::array<double, 5> kAccelDelay_ms = {28.8, 16.8, 10.8, 7.8, 6.3};

double gyro_delay_s(const Stim300Setup& setup) {
  return (kGyroDelay_ms[static_cast<std::size_t>(setup.gyro_filter)] + (setup.gyro_unit >= 8 ? 4.0 : 0.0)) * 1e-3;
}
double accel_delay_s(const Stim300Setup& setup) {
  const double faster_ms = setup.accel_range_g == 80 ? 0.2 : setup.accel_range_g == 30 ? 0.1 : 0.0;
  return (kAccelDelay_ms[static_cast<std::size_t>(setup.accel_filter)] - faster_ms) * 1e-3;
}

// Counts per g are 2^this; per m/s of an increment eight times as many.
int accel_bits(int range_g) { return range_g == 5 ? 20 : range_g == 10 ? 19 : range_g == 30 ? 18 : 16; }

std::int32_t saturated(double counts) {
  return static_cast<std::int32_t>(std::clamp(std::round(counts), -8388608.0, 8388607.0));
}

}  // namespace

Stim300Emulator::Stim300Emulator(const Stim300Setup& setup, std::int64_t t_on_ns, std::uint64_t seed)
    : saved_(setup),
      rate_rad_s_([](double) { return std::array<double, 3>{}; }),
      force_m_s2_([](double) { return std::array<double, 3>{0.0, 0.0, kGravity}; }),
      random_(seed) {
  restart(t_on_ns);
}

void Stim300Emulator::restart(std::int64_t t_ns) {
  setup_ = saved_;
  service_mode_ = false;
  asking_to_save_ = false;
  line_.clear();
  requested_.reset();
  counter_ = 0;
  summed_ = 0;
  gyro_sum_ = accel_sum_ = {};
  t_on_ns_ = t_ns;
  t_line_free_ns_ = t_ns + kFirstSpecial_ns;
  send(encode_part_number(setup_), t_line_free_ns_);
  send(encode_serial_number(setup_), t_line_free_ns_);
  send(encode_configuration(setup_), t_line_free_ns_);
  t_next_tick_ns_ = t_line_free_ns_ + kTick_ns;
  t_start_up_over_ns_ = t_next_tick_ns_ + kStartUp_ns;
}

double Stim300Emulator::uniform() {
  random_ = random_ * 6364136223846793005U + 1442695040888963407U;
  return static_cast<double>(random_ >> 11U) * 0x1.0p-53;
}

std::vector<Transmission> Stim300Emulator::run_until(std::int64_t t_ns) {
  while (t_next_tick_ns_ <= t_ns) tick();
  std::vector<Transmission> due;
  const auto later =
      std::find_if(sent_.begin(), sent_.end(), [t_ns](const Transmission& t) { return t.t_end_ns > t_ns; });
  due.assign(std::make_move_iterator(sent_.begin()), std::make_move_iterator(later));
  sent_.erase(sent_.begin(), later);
  return due;
}

// Beyond its range an accelerometer says the end of it; the status has bit 4 then, and one bit for each axis.
void Stim300Emulator::limit(std::array<double, 3>& force_m_s2) {
  const double most = setup_.accel_range_g * kGravity;
  for (unsigned axis = 0; axis < 3; ++axis) {
    if (std::abs(force_m_s2[axis]) <= most) continue;
    force_m_s2[axis] = std::copysign(most, force_m_s2[axis]);
    overload_ |= static_cast<std::uint8_t>(1U << axis);
  }
}

// One internal sample, and every so many of them a datagram.
void Stim300Emulator::tick() {
  const double t_s = static_cast<double>(t_next_tick_ns_) * 1e-9;
  const std::array<double, 3> rate = rate_rad_s_(t_s - gyro_delay_s(setup_));
  std::array<double, 3> force = force_m_s2_(t_s - accel_delay_s(setup_));
  limit(force);
  for (std::size_t i = 0; i < 3; ++i) {
    gyro_sum_[i] += rate[i] * 180.0 / std::numbers::pi;
    accel_sum_[i] += force[i];
  }
  ++summed_;
  ++counter_;
  const std::int64_t t_ns = t_next_tick_ns_;
  t_next_tick_ns_ += kTick_ns;
  if (service_mode_ || counter_ % setup_.internal_samples() != 0) return;

  // The newest internal sample alone, or all since the last datagram.
  const auto reduce = [this](std::array<double, 3>& sum, const std::array<double, 3>& newest, int unit) {
    std::array<double, 3> value = newest;
    if (unit == 1) std::transform(sum.begin(), sum.end(), value.begin(), [](double s) { return s / kInternalRate; });
    if (unit == 2) std::transform(sum.begin(), sum.end(), value.begin(), [this](double s) { return s / summed_; });
    sum = {};
    return value;
  };
  std::array<double, 3> rate_deg_s = rate;
  for (double& r : rate_deg_s) r *= 180.0 / std::numbers::pi;
  const std::array<double, 3> gyro = reduce(gyro_sum_, rate_deg_s, setup_.gyro_unit % 8);
  const std::array<double, 3> accel = reduce(accel_sum_, force, setup_.accel_unit);
  summed_ = 0;
  if (!faults_.stuck) {
    const double gyro_scale = std::ldexp(1.0, setup_.gyro_unit % 8 == 1 ? 21 : 14);
    const double accel_scale = setup_.accel_unit == 1 ? std::ldexp(8.0, accel_bits(setup_.accel_range_g))
                                                      : std::ldexp(1.0 / kGravity, accel_bits(setup_.accel_range_g));
    for (std::size_t i = 0; i < 3; ++i) {  // the last bits are noise, as in any unit
      content_.gyro[i] = saturated(gyro[i] * gyro_scale + 2.0 * uniform() - 1.0);
      content_.accel[i] = saturated(accel[i] * accel_scale + 2.0 * uniform() - 1.0);
      content_.temperature[i] = 25 << 8;
    }
  }
  const std::uint8_t starting = t_ns < t_start_up_over_ns_ ? 0x40 : 0;
  content_.gyro_status = content_.accel_status = content_.other_status = faults_.status | starting;
  if (overload_ != 0) content_.accel_status |= static_cast<std::uint8_t>(0x10U | overload_);
  overload_ = 0;
  content_.counter = counter_;
  const std::int64_t t_start_ns = t_ns + kLatency_ns;
  if (t_start_ns < t_line_free_ns_) return;  // still sending the one before: this one is dropped
  send(requested_ ? *requested_ : encode_normal(setup_, content_), t_start_ns);
  requested_.reset();
}

void Stim300Emulator::send(Bytes bytes, std::int64_t t_start_ns) {
  constexpr std::int64_t kBitsPerByte = 10;
  const std::int64_t wire_ns = static_cast<std::int64_t>(bytes.size()) * kBitsPerByte * 1'000'000'000 / setup_.baud;
  t_line_free_ns_ = t_start_ns + wire_ns;
  Bytes arriving;
  for (std::uint8_t byte : bytes) {
    if (uniform() < faults_.lost_byte) continue;
    if (uniform() < faults_.flipped_bit) byte ^= static_cast<std::uint8_t>(1U << static_cast<unsigned>(8 * uniform()));
    arriving.push_back(byte);
    if (uniform() < faults_.doubled_byte) arriving.push_back(byte);
  }
  if (!faults_.unplugged) sent_.push_back({.t_end_ns = t_line_free_ns_ + faults_.late_ns, .bytes = arriving});
}

}  // namespace plumb::emulator
