#include "fsw/app/command_judge.h"

#include <gtest/gtest.h>

#include <limits>

namespace plumb {
namespace {

constexpr auto kReset = static_cast<std::uint16_t>(CommandId::kReset);

CommandVerdict verdict_of(CommandJudge& judge, Command command) {
  Parameters staged;
  judge.judge(command, staged);
  return command.verdict;
}

TEST(CommandJudge, AcceptsWhatItKnowsOnce) {
  CommandJudge judge;
  EXPECT_EQ(verdict_of(judge, {.source = 1, .sequence = 7, .id = kReset}), CommandVerdict::kAccepted);
  EXPECT_EQ(verdict_of(judge, {.source = 1, .sequence = 7, .id = kReset}), CommandVerdict::kRepeated);
  EXPECT_EQ(verdict_of(judge, {.source = 2, .sequence = 7, .id = kReset}), CommandVerdict::kAccepted);
  EXPECT_EQ(verdict_of(judge, {.source = 1, .sequence = 6, .id = kReset}), CommandVerdict::kAccepted) << "it restarted";
}

TEST(CommandJudge, RefusesWhatIsNone) {
  CommandJudge judge;
  EXPECT_EQ(verdict_of(judge, {.sequence = 1, .id = 0}), CommandVerdict::kUnknown);
  EXPECT_EQ(verdict_of(judge, {.sequence = 2, .id = 0xffff}), CommandVerdict::kUnknown);
  for (const double value : {1.0, std::numeric_limits<double>::quiet_NaN()}) {
    Command command{.sequence = static_cast<std::uint32_t>(value > 0.0 ? 3 : 4), .id = kReset};
    command.arguments[3] = value;
    EXPECT_EQ(verdict_of(judge, command), CommandVerdict::kArgument);
  }
}

TEST(CommandJudge, ADamagedCommandIsNeitherObeyedNorRemembered) {
  CommandJudge judge;
  const Command damaged{.source = 1, .sequence = 7, .id = kReset, .verdict = CommandVerdict::kChecksum};
  EXPECT_EQ(verdict_of(judge, damaged), CommandVerdict::kChecksum);
  EXPECT_FALSE(damaged.is(CommandId::kReset));
  EXPECT_EQ(verdict_of(judge, {.source = 1, .sequence = 7, .id = kReset}), CommandVerdict::kAccepted);
}

TEST(CommandJudge, AnyNumberOfSourcesIsHeard) {
  CommandJudge judge;
  for (std::uint32_t source = 0; source < 100; ++source) {
    EXPECT_EQ(verdict_of(judge, {.source = source, .sequence = 1, .id = kReset}), CommandVerdict::kAccepted);
  }
  EXPECT_EQ(verdict_of(judge, {.source = 99, .sequence = 1, .id = kReset}), CommandVerdict::kRepeated);
}

}  // namespace
}  // namespace plumb
