#pragma once
// A controller on a classic CAN bus (ISO 11898-1): data frames in and out, and how the controller is doing.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "fsw/base/fault_counter.h"
#include "fsw/base/status.h"
#include "fsw/base/time.h"

namespace plumb {

inline constexpr std::size_t kCanMaxDataBytes = 8;
inline constexpr std::uint32_t kCanStandardIdMask = 0x7FF;
inline constexpr std::uint32_t kCanExtendedIdMask = 0x1FFF'FFFF;

/// A data frame.
struct CanFrame {
  std::uint32_t id = 0;  ///< 11 bits, or 29 if extended; without flags
  bool is_extended = false;
  std::uint8_t size = 0;  ///< data bytes (DLC), 0 to 8
  std::array<std::uint8_t, kCanMaxDataBytes> bytes{};

  std::span<const std::uint8_t> data() const { return {bytes.data(), size}; }
  friend bool operator==(const CanFrame&, const CanFrame&) = default;
};

struct ReceivedCanFrame {
  Time t;  ///< end of the frame on the bus, on the flight clock
  CanFrame frame;
};

/// Lets frames of one kind through whose id agrees with `id` in the bits of `mask`.
struct CanFilter {
  std::uint32_t id = 0;
  std::uint32_t mask = 0;
  bool is_extended = false;
};

/// Fault confinement of the controller (ISO 11898-1), and what keeps it from the bus altogether.
enum class CanState : std::uint8_t {
  kActive = 0,
  kWarning,  ///< an error counter is past 96
  kPassive,  ///< past 127: it may no longer destroy frames that it finds wrong
  kBusOff,   ///< past 255: it neither sends nor receives until it is restarted
  kDown,     ///< the interface is down or gone
};

struct CanHealth {
  CanState state = CanState::kActive;
  std::uint32_t received = 0;  ///< data frames that passed the filters
  std::uint32_t sent = 0;      ///< data frames handed to the controller
  /// What the controller reported, state changes included. Value: class of the error (linux/can/error.h), and in the
  /// lowest 8 bits what it says of the controller.
  FaultCounter error_frames;
  std::uint32_t bus_offs = 0;
  std::uint32_t restarts = 0;   ///< returns from bus-off or down
  std::uint32_t overflows = 0;  ///< frames lost because nobody took them in time
  /// Stamps that no frame can have; the time of reading was taken. Value: age that the stamp told [ns].
  FaultCounter stamps_mended;
};

class CanSocket {
 public:
  virtual ~CanSocket() = default;

  /// Replaces the filters; a frame that passes one of them is received. None: nothing is. kFull when there are more
  /// than the implementation takes, kRejected when the system refused them; the old ones stay.
  virtual Status set_filters(std::span<const CanFilter> filters) = 0;
  /// The oldest frame not taken yet, waiting for one at most `timeout`; zero or less does not wait. kNotReady: none
  /// came. kRejected: the interface is down or gone; later calls try to come back by themselves.
  virtual Result<ReceivedCanFrame> receive(Duration timeout) = 0;
  /// Hands a frame over without waiting. kFull: the queue to the controller has no room, try later. kRejected: bus off,
  /// down, or refused by the system. kInvalidValue: no such frame exists.
  virtual Status send(const CanFrame& frame) = 0;

  virtual const CanHealth& health() const = 0;
  /// The system's error number (errno) of the last call that failed; 0 when none has.
  virtual int last_error() const = 0;
};

}  // namespace plumb
