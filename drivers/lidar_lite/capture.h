#pragma once
// Transfers on the bus of a LIDAR-Lite become measurements, whoever asked for them: the driver at this moment, or a
// host whose transfers were recorded.

#include <cstdint>

#include "drivers/lidar_lite/models.h"
#include "fsw/base/fixed_vector.h"
#include "fsw/base/status.h"
#include "fsw/base/time.h"

namespace plumb::lidar_lite {

inline constexpr std::size_t kMaxTransferBytes = 8;

/// One transfer with the device, START to STOP.
struct Transfer {
  Time t_stop;  ///< flight clock at the STOP
  bool is_read = false;
  bool acknowledged = false;
  FixedVector<std::uint8_t, kMaxTransferBytes> bytes;  ///< read, or written with the register first
};

struct Measurement {
  Interpreted interpreted;
  std::uint8_t status = 0;
  std::uint8_t strength = 0;  ///< 0 where the model has none
  /// Middle of the acquisition: between the STOP of the command and the STOP of the first status that is not busy.
  Time t;
};

class Capture {
 public:
  explicit Capture(Model model) : table_(&table_of(model)) {}

  /// The measurement that this transfer completes; kNotReady for any other. One without its command, without the end of
  /// busy or without one of its registers is none. What was not acknowledged is passed over.
  Result<Measurement> decode(const Transfer& transfer);
  /// Commands after which the next command came before a measurement.
  std::uint32_t unread() const { return unread_; }

 private:
  void on_write(const Transfer& transfer);
  bool complete() const {
    return measuring_ && has_status_ && has_distance_ && (has_strength_ || !table_->has_strength);
  }

  const ModelTable* table_;
  bool has_pointer_ = false;
  std::uint8_t pointer_ = 0;  ///< register that the next read begins at
  bool measuring_ = false;    ///< a command was given
  bool has_status_ = false;
  bool has_distance_ = false;
  bool has_strength_ = false;
  Time t_command_;
  Time t_ready_;
  Reading reading_;
  std::uint32_t unread_ = 0;
};

}  // namespace plumb::lidar_lite
