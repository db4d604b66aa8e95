#pragma once
// A serial line: bytes in and out. Speed and format belong to the implementation, which is opened with them.

#include <cstddef>
#include <cstdint>
#include <span>

#include "fsw/base/status.h"
#include "fsw/base/time.h"

namespace plumb {

/// What one read of the line returned.
struct SerialChunk {
  Time t;                ///< flight clock when the bytes were taken: the last of them arrived then, or before
  std::size_t size = 0;  ///< bytes, at the beginning of the buffer
};

class SerialPort {
 public:
  virtual ~SerialPort() = default;

  /// The bytes that are there, at most as many as the buffer holds, waiting for the first of them at most `timeout`;
  /// zero or less does not wait. kNotReady: none came. kRejected: the line is gone or the system failed; last_error()
  /// has the reason, and later calls try to come back by themselves. kInvalidValue: the buffer is empty.
  virtual Result<SerialChunk> read(std::span<std::uint8_t> buffer, Duration timeout) = 0;
  /// Hands all bytes to the system, waiting at most `timeout`; they are on the line some time later. kFull: there was
  /// not room for all of them, and a part may have gone. kRejected: as read().
  virtual Status write(std::span<const std::uint8_t> bytes, Duration timeout) = 0;
  /// The system's error number (errno) of the last call that failed; 0 when none has.
  virtual int last_error() const = 0;
  /// How often the line was there again after it had gone.
  virtual std::uint64_t reopens() const = 0;
};

}  // namespace plumb
