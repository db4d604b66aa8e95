#include "test/emulators/lidar_lite/lidar_lite_emulator.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace plumb::test {
namespace {

constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max();

std::string hex(unsigned value) {
  constexpr const char* kDigits = "0123456789abcdef";
  return std::string("0x") + kDigits[value >> 4U & 0xFU] + kDigits[value & 0xFU];
}

}  // namespace

LidarLiteEmulator::LidarLiteEmulator(Kind kind) : kind_(kind) {
  if (kind == Kind::kV4Led) {
    writable_ = {0x00, 0x05, 0xE2, 0xE5, 0xEB};
    readable_ = {0x01, 0x05, 0x10, 0x11, 0x16, 0x17, 0x18, 0x19, 0xE1, 0xE2, 0xE5, 0xEB};
  } else {
    writable_ = {0x00, 0x02, 0x04, 0x11, 0x12, 0x1C, 0x45, 0x65};
    readable_ = {0x01, 0x02, 0x04, 0x09, 0x0C, 0x0D, 0x0E, 0x0F, 0x10, 0x11, 0x12,
                 0x14, 0x15, 0x16, 0x17, 0x1C, 0x41, 0x45, 0x4C, 0x4F, 0x65};
  }
  set_range_m(10.0);
  power_on(0);
}

void LidarLiteEmulator::power_on(std::int64_t now_ns) {
  registers_.fill(0);
  if (kind_ == Kind::kV4Led) {
    registers_[0x05] = 0xFF;
    registers_[0xE1] = 0x10;
    registers_[0xE2] = 0xFF;
  } else {
    registers_[0x02] = 0x80;
    registers_[0x04] = 0x08;
    registers_[0x12] = 0x05;
    registers_[0x45] = 0x14;
    registers_[0x41] = kind_ == Kind::kV3 ? 0x15 : 0x00;
    registers_[0x4F] = kind_ == Kind::kV3 ? 0x15 : 0x00;
    registers_[0x16] = 0x12;
    registers_[0x17] = 0x34;
  }
  pointer_.reset();
  pending_ = false;
  busy_until_ns_ = now_ns + kPowerOn_ns;
  answers_from_ns_ = now_ns + kPowerOn_ns;
  world.stuck_zero = false;
}

bool LidarLiteEmulator::answers(std::uint8_t address, std::int64_t now_ns) {
  if (address != 0x62 || world.dead || now_ns < answers_from_ns_) return false;
  if (world.refuse_next > 0) {
    --world.refuse_next;
    return false;
  }
  return !(world.refuses_while_busy && busy(now_ns));
}

void LidarLiteEmulator::command(std::uint8_t value, std::int64_t now_ns) {
  if (value == 0x00) {
    ++resets_;
    power_on(now_ns);
    return;
  }
  const bool known = kind_ == Kind::kV3Hp || value == 0x03 || value == 0x04;
  if (!known) violation("command " + hex(value));
  if (busy(now_ns)) violation("command while busy");
  ++measurements_;
  command_times_ns_.push_back(now_ns);
  without_bias_ = value == 0x04 || kind_ == Kind::kV3Hp ? 0 : without_bias_ + 1;
  longest_without_bias_ = std::max(longest_without_bias_, without_bias_);
  acquisition_start_ns_ = now_ns;
  busy_until_ns_ = world.stuck_busy ? kNever_ns : now_ns + world.acquisition_ns;
  pending_ = true;
}

// Puts the result into the registers once busy is over.
void LidarLiteEmulator::settle(std::int64_t now_ns) {
  std::uint8_t status = world.healthy && kind_ != Kind::kV4Led ? 0x20 : 0x00;
  if (!world.healthy && kind_ == Kind::kV4Led) status = 0x20;
  if (busy(now_ns)) {
    registers_[0x01] = status | 0x01;
    return;
  }
  if (!pending_) return;
  pending_ = false;
  const std::optional<double> range_m = range_at_((acquisition_start_ns_ + busy_until_ns_) / 2);
  const double reach_m = kind_ == Kind::kV4Led ? 10.0 : 40.0;
  const bool seen = range_m && *range_m > 0.0 && *range_m <= reach_m;
  unsigned centimetres = seen ? static_cast<unsigned>(std::lround(*range_m * 100.0)) : world.no_return_cm;
  if (!seen && kind_ != Kind::kV4Led) status |= 0x08;
  if (world.stuck_zero) centimetres = 0;
  if (world.spoil_every > 0 && measurements_ % world.spoil_every == 0) centimetres = 1;
  if (world.not_ready) centimetres |= 0x8000U;
  const auto high = static_cast<std::uint8_t>(centimetres >> 8U);
  const auto low = static_cast<std::uint8_t>(centimetres);
  if (kind_ == Kind::kV4Led) {
    registers_[0x10] = low;
    registers_[0x11] = high;
  } else {
    registers_[0x0F] = high;
    registers_[0x10] = low;
    registers_[0x0E] = seen ? world.strength : 0;
    registers_[0x0C] = seen ? 180 : 0;
  }
  registers_[0x01] = status;
}

bool LidarLiteEmulator::write(std::uint8_t address, std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  if (!answers(address, now_ns)) return false;
  settle(now_ns);
  pointer_.reset();
  if (bytes.empty() || bytes.size() > 2) {
    violation("a write of " + std::to_string(bytes.size()) + " bytes");
    return false;
  }
  if (bytes.size() == 1) {
    pointer_ = bytes[0];
    return true;
  }
  if (!writable_.contains(bytes[0])) {
    violation("write to register " + hex(bytes[0]));  // the bus has no way to refuse it
  } else if (bytes[0] == 0x00) {
    command(bytes[1], now_ns);
  } else if (!world.forgets_writes) {
    registers_[bytes[0]] = bytes[1];
  }
  return true;
}

bool LidarLiteEmulator::read(std::uint8_t address, std::span<std::uint8_t> bytes, std::int64_t now_ns) {
  if (!answers(address, now_ns)) return false;
  settle(now_ns);
  if (!pointer_) {
    violation("a read without a register");
    return false;
  }
  // The v3 goes on to the next register only when bit 7 asks for it; on the others all eight bits are the address or,
  // v3HP, the bit is ignored.
  const bool flagged = (*pointer_ & 0x80U) != 0;
  unsigned next = kind_ == Kind::kV4Led ? *pointer_ : *pointer_ & 0x7FU;
  const unsigned step = kind_ == Kind::kV3 && !flagged ? 0 : 1;
  pointer_.reset();
  const bool distance = next <= 0x11 && next + step * bytes.size() > 0x0F && (next >= 0x0E);
  if (distance && busy(now_ns)) violation("a result read while busy");
  for (std::uint8_t& byte : bytes) {
    const auto reg = static_cast<std::uint8_t>(next);
    if (!readable_.contains(reg)) violation("read of register " + hex(reg));
    byte = readable_.contains(reg) ? registers_[reg] : 0;
    next += step;
  }
  return true;
}

}  // namespace plumb::test
