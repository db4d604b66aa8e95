#pragma once
// Which commands are carried out. A refused one is logged and answered as well.

#include "fsw/base/fixed_vector.h"
#include "fsw/measurement/command.h"

namespace plumb {

class CommandJudge {
 public:
  /// Sources whose last sequence number is remembered. One more takes the place of the one that came first.
  static constexpr std::size_t kMaxSources = 8;

  /// Gives a command that is undamaged its verdict.
  void judge(Command& command) {
    if (command.verdict != CommandVerdict::kAccepted) return;
    if (is_repeated(command)) {
      command.verdict = CommandVerdict::kRepeated;
    } else if (!exists(command.id)) {
      command.verdict = CommandVerdict::kUnknown;
    } else if (command.arguments != decltype(command.arguments){}) {  // none has any
      command.verdict = CommandVerdict::kArgument;
    }
  }

 private:
  struct Last {
    std::uint32_t source = 0;
    std::uint32_t sequence = 0;
  };

  static bool exists(std::uint16_t id) {
    switch (static_cast<CommandId>(id)) {
      case CommandId::kPing:
      case CommandId::kReset: return true;
    }
    return false;
  }

  bool is_repeated(const Command& command) {
    for (Last& last : last_) {
      if (last.source != command.source) continue;
      const bool repeated = last.sequence == command.sequence;
      last.sequence = command.sequence;
      return repeated;
    }
    if (last_.full()) last_.erase(0);
    static_cast<void>(last_.push_back({command.source, command.sequence}));
    return false;
  }

  FixedVector<Last, kMaxSources> last_;
};

}  // namespace plumb
