#pragma once
// A STIM300 with two faces. The bus face speaks its protocol to the byte: start-up, datagrams at its rate, commands in
// Normal and Service mode. The physical face is what a test does to it: the motion it feels, and what goes wrong.
// Time is what the caller says it is, so a test runs as fast as it can; stim300_on_pty.h runs it on a real line.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "test/emulators/stim300/stim300_encoder.h"

namespace plumb::emulator {

/// Bytes on the wire, and when the last of them has arrived [ns].
struct Transmission {
  std::int64_t t_end_ns = 0;
  Bytes bytes;
};

/// X, Y, Z at a time [s] on the emulator's clock.
using Motion = std::function<std::array<double, 3>(double t_s)>;

struct Stim300Faults {
  double flipped_bit = 0.0;  ///< probabilities per byte on the wire
  double lost_byte = 0.0;
  double doubled_byte = 0.0;
  bool stuck = false;        ///< the sensors repeat their last numbers, the counter runs
  std::uint8_t status = 0;   ///< set in the status bytes of gyros and accelerometers
  std::int64_t late_ns = 0;  ///< bytes arrive that much later
  bool unplugged = false;    ///< nothing arrives, the unit runs on
};

class Stim300Emulator {
 public:
  /// Switched on at `t_on_ns`. `setup` is what its flash memory holds.
  Stim300Emulator(const Stim300Setup& setup, std::int64_t t_on_ns, std::uint64_t seed);

  // Physical face.
  void set_rate(Motion rad_s) { rate_rad_s_ = std::move(rad_s); }
  void set_specific_force(Motion m_s2) { force_m_s2_ = std::move(m_s2); }
  Stim300Faults& faults() { return faults_; }
  /// Power off and on again.
  void restart(std::int64_t t_ns);

  // Bus face.
  void receive(std::span<const std::uint8_t> bytes, std::int64_t t_ns);
  /// Everything sent up to `t_ns`, in order.
  std::vector<Transmission> run_until(std::int64_t t_ns);

  const Stim300Setup& setup() const { return setup_; }
  bool in_service_mode() const { return service_mode_; }

  static constexpr std::int64_t kTick_ns = 500'000;
  static constexpr std::int64_t kStartUp_ns = 281'000'000;  ///< as in a capture of a real unit

 private:
  void tick();
  Stim300Content measure();
  void limit(std::array<double, 3>& force_m_s2);
  void send(Bytes bytes, std::int64_t t_start_ns);
  void on_normal_command(const std::string& command, std::int64_t t_ns);
  std::string on_service_command(const std::string& command, std::int64_t t_ns);
  double uniform();

  Stim300Setup saved_;
  Stim300Setup setup_;
  Motion rate_rad_s_;
  Motion force_m_s2_;
  Stim300Faults faults_;
  std::uint64_t random_;

  std::int64_t t_on_ns_;
  std::int64_t t_start_up_over_ns_;
  std::int64_t t_next_tick_ns_;
  std::int64_t t_line_free_ns_ = 0;
  std::uint8_t counter_ = 0;
  std::array<double, 3> gyro_sum_{};
  std::array<double, 3> accel_sum_{};
  int summed_ = 0;
  std::uint8_t overload_ = 0;  ///< axes of the accelerometer beyond their range since the last datagram
  Stim300Content content_;
  std::optional<Bytes> requested_;  ///< special datagram in place of the next normal one

  bool service_mode_ = false;
  bool asking_to_save_ = false;
  std::string line_;
  std::vector<Transmission> sent_;
};

}  // namespace plumb::emulator
