#include "drivers/lidar_lite/capture.h"

#include <algorithm>

namespace plumb::lidar_lite {
namespace {

// Bit 7 of a register's address asks the v3 for auto-increment; hosts differ in setting it.
constexpr std::uint8_t kAutoIncrement = 0x80;

bool same_register(std::uint8_t a, std::uint8_t b) { return (a | kAutoIncrement) == (b | kAutoIncrement); }

Time middle(Time a, Time b) { return a + (b - a) / 2; }

}  // namespace

void Capture::on_write(const Transfer& transfer) {
  has_pointer_ = transfer.bytes.size() == 1;
  if (transfer.bytes.empty()) return;
  pointer_ = transfer.bytes[0];
  if (transfer.bytes.size() < 2 || transfer.bytes[0] != kRegisterCommand) return;
  if (measuring_) ++unread_;
  measuring_ = transfer.bytes[1] == table_->command_plain || transfer.bytes[1] == table_->command_bias;
  has_status_ = has_distance_ = has_strength_ = false;
  reading_ = {};
  t_command_ = transfer.t_stop;
}

Result<Measurement> Capture::decode(const Transfer& transfer) {
  if (!transfer.acknowledged) return Status::kNotReady;
  if (!transfer.is_read) {
    on_write(transfer);
    return Status::kNotReady;
  }
  const bool expected = measuring_ && has_pointer_ && !transfer.bytes.empty();
  has_pointer_ = false;
  if (!expected) return Status::kNotReady;
  if (pointer_ == kRegisterStatus) {
    reading_.status = transfer.bytes[0];
    if (!has_status_ && (reading_.status & kStatusBusy) == 0) {
      has_status_ = true;
      t_ready_ = transfer.t_stop;
    }
  } else if (has_status_ && same_register(pointer_, table_->distance_register) && transfer.bytes.size() >= 2) {
    std::copy_n(transfer.bytes.begin(), reading_.distance.size(), reading_.distance.begin());
    has_distance_ = true;
  } else if (has_status_ && table_->has_strength && same_register(pointer_, table_->strength_register)) {
    reading_.strength = transfer.bytes[0];
    has_strength_ = true;
  }
  if (!complete()) return Status::kNotReady;
  measuring_ = false;
  return Measurement{.interpreted = interpret(*table_, reading_),
                     .status = reading_.status,
                     .strength = reading_.strength,
                     .t = middle(t_command_, t_ready_)};
}

}  // namespace plumb::lidar_lite
