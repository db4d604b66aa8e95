#pragma once
// Which commands are carried out. A refused one is logged and answered as well.

#include "fsw/app/parameter_change.h"
#include "fsw/base/fixed_vector.h"
#include "fsw/measurement/command.h"

namespace plumb {

class CommandJudge {
 public:
  /// Sources whose last sequence number is remembered. One more takes the place of the one that came first.
  static constexpr std::size_t kMaxSources = 8;

  /// Gives a command that is undamaged its verdict. `staged`: the parameters as the commands before it leave them; one
  /// that is accepted and sets one is in there then.
  void judge(Command& command, Parameters& staged) {
    if (command.verdict != CommandVerdict::kAccepted) return;
    command.verdict = is_repeated(command) ? CommandVerdict::kRepeated : verdict_of(command, staged);
  }

 private:
  struct Last {
    std::uint32_t source = 0;
    std::uint32_t sequence = 0;
  };

  static CommandVerdict verdict_of(const Command& command, Parameters& staged) {
    switch (static_cast<CommandId>(command.id)) {
      case CommandId::kPing:
      case CommandId::kReset:
      case CommandId::kTellParameters:
        return command.arguments == decltype(command.arguments){} ? CommandVerdict::kAccepted
                                                                  : CommandVerdict::kArgument;
      case CommandId::kSetParameter: return judge_set(command, staged);
    }
    return CommandVerdict::kUnknown;
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
