#pragma once
// A LIDAR-Lite in software, with two faces: the bus, where it does to the bit what a device does, and the world, where
// a test sets what it sees and what is wrong with it. Written from the register maps of the operation manuals; it
// shares no code with the driver.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace plumb::test {

class LidarLiteEmulator {
 public:
  enum class Kind { kV3, kV3Hp, kV4Led };

  /// Powered on at time 0: the first `power_on_ns` it does not answer.
  explicit LidarLiteEmulator(Kind kind);

  // The bus. Times in ns, never going back. False: not acknowledged.
  bool write(std::uint8_t address, std::span<const std::uint8_t> bytes, std::int64_t now_ns);
  bool read(std::uint8_t address, std::span<std::uint8_t> bytes, std::int64_t now_ns);

  // The world.
  /// Distance of the target; nothing: no target.
  void set_range_m(std::optional<double> range_m) {
    range_at_ = [range_m](std::int64_t) { return range_m; };
  }
  /// A target that moves: its distance over time [ns]. A measurement sees it at the middle of its acquisition.
  void set_motion(std::function<std::optional<double>(std::int64_t)> range_at) { range_at_ = std::move(range_at); }

  struct World {
    std::int64_t acquisition_ns = 8'000'000;
    std::uint8_t strength = 120;
    std::uint8_t no_return_cm = 1;  ///< what a unit says without a return; some say 0
    bool healthy = true;
    bool dead = false;        ///< answers nothing
    bool stuck_busy = false;  ///< a measurement never ends
    bool stuck_zero = false;  ///< distance 0 with a good status, until it is reset
    bool not_ready = false;   ///< top bit of the distance set
    bool refuses_while_busy = false;
    bool forgets_writes = false;  ///< registers keep their defaults
    int refuse_next = 0;          ///< transfers not to acknowledge
    int spoil_every = 0;          ///< every n-th measurement is a return that is none: 1 cm with a good status
  };
  World world;

  // What the device has seen.
  /// What no host may do, in words: unknown registers and commands, reads without a register, transfers too long,
  /// a distance read while busy.
  const std::vector<std::string>& violations() const { return violations_; }
  int resets() const { return resets_; }
  int measurements() const { return measurements_; }
  /// Longest run of measurements without bias correction.
  int longest_without_bias() const { return longest_without_bias_; }
  std::uint8_t reg(std::uint8_t address) const { return registers_[address]; }
  const std::vector<std::int64_t>& command_times_ns() const { return command_times_ns_; }

 private:
  static constexpr std::int64_t kPowerOn_ns = 22'000'000;  // v3 manual: 22 ms

  void power_on(std::int64_t now_ns);
  void command(std::uint8_t value, std::int64_t now_ns);
  void settle(std::int64_t now_ns);
  bool answers(std::uint8_t address, std::int64_t now_ns);
  void violation(const std::string& what) { violations_.push_back(what); }
  bool busy(std::int64_t now_ns) const { return busy_until_ns_ > now_ns; }

  Kind kind_;
  std::set<std::uint8_t> writable_;
  std::set<std::uint8_t> readable_;
  std::array<std::uint8_t, 256> registers_{};
  std::function<std::optional<double>(std::int64_t)> range_at_;
  std::int64_t answers_from_ns_ = 0;
  std::int64_t busy_until_ns_ = 0;
  std::int64_t acquisition_start_ns_ = 0;
  bool pending_ = false;  ///< a result waits to be put into the registers when busy ends
  std::optional<std::uint8_t> pointer_;
  int resets_ = 0;
  int measurements_ = 0;
  int without_bias_ = 0;
  int longest_without_bias_ = 0;
  std::vector<std::string> violations_;
  std::vector<std::int64_t> command_times_ns_;
};

}  // namespace plumb::test
