#pragma once
// Sets a STIM300 up in its Service mode: a dialogue in ASCII, one command at a time, each answered by a prompt. It
// knows no line and no clock. Source: data sheet TS1524 rev.31, section 9.

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/stim300/configuration.h"
#include "fsw/base/fixed_vector.h"
#include "fsw/base/status.h"
#include "fsw/base/time.h"

namespace plumb::stim300 {

class ServiceSetup {
 public:
  static constexpr std::size_t kMaxCommandBytes = 16;
  using Command = FixedVector<std::uint8_t, kMaxCommandBytes>;

  /// `save`: also into the flash memory, which takes 10 000 times; else until the unit is reset. The speed of the line
  /// stays what it is. Precondition: is_usable(settings).
  ServiceSetup(const Settings& settings, bool save) : settings_(settings), save_(save) {}

  /// What came from the unit, at `now`.
  void receive(std::span<const std::uint8_t> bytes, Time now);
  /// The command to send at `now`, empty when it is not time. Call it every 10 ms or so until status() is not
  /// kNotReady.
  Command poll(Time now);

  /// kOk: done, and the unit is back in Normal mode. kRejected: it refused a command, see error_code(). kStale: it did
  /// not answer.
  Status status() const { return status_; }
  /// The number in the unit's message, such as 1 for "E001 UNKNOWN COMMAND".
  int error_code() const { return error_code_; }
  /// The command that failed, or is being answered.
  const Command& command() const { return command_; }

 private:
  enum class Step : std::uint8_t {
    kEnter = 0,
    kRate,
    kContent,
    kGyroUnit,
    kAccelUnit,
    kGyroFilter,
    kAccelFilter,
    kSave,
    kConfirm,
    kLeave,
    kDone
  };

  Command command_for(Step step) const;
  void look_for_error(std::uint8_t byte);

  Settings settings_;
  bool save_;
  Status status_ = Status::kNotReady;
  Step step_ = Step::kEnter;
  Command command_;
  bool waiting_ = false;      ///< for the answer to command_
  bool prompt_seen_ = false;  ///< as the last byte
  Time t_sent_;
  Time t_last_byte_;
  int error_digits_ = -1;  ///< digits seen after an E; -1: none
  int error_number_ = 0;
  int error_code_ = 0;
};

}  // namespace plumb::stim300
