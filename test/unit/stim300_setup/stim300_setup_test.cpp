// plumb-stim300-setup against the emulated unit on a real pseudo-terminal.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <string>

#include "test/emulators/stim300/stim300_on_pty.h"
#include "test/support/process.h"

namespace plumb::test {
namespace {

using emulator::Stim300Emulator;
using emulator::Stim300OnPty;
using emulator::Stim300Setup;

struct Outcome {
  int exit_code = -1;
  std::string text;
};

Outcome run(const std::string& arguments) {
  const ProgramOutput output = output_of(std::string(PLUMB_STIM300_SETUP) + " " + arguments + " 2>&1");
  return {WIFEXITED(output.exit_status) ? WEXITSTATUS(output.exit_status) : -1, output.text};
}

Stim300Setup setup_of(Stim300OnPty& unit) {
  Stim300Setup setup;
  unit.with_unit([&setup](Stim300Emulator& emulator) { setup = emulator.setup(); });
  return setup;
}

TEST(Stim300SetupTool, SetsAUnitUpAndSaysSo) {
  Stim300OnPty unit({.rate_code = 0, .cr_lf = true, .gyro_unit = 0, .accel_unit = 0, .gyro_filter = 1}, 1);
  const Outcome before = run("--check " + unit.device());
  EXPECT_EQ(before.exit_code, 1);
  EXPECT_NE(before.text.find("datagrams a second is 125, wanted is 250"), std::string::npos) << before.text;
  for (const char* difference :
       {"gyro unit is rate, wanted is increment\n", "accelerometer unit is acceleration, wanted is increment\n"}) {
    EXPECT_NE(before.text.find(difference), std::string::npos) << before.text;
  }
  const Outcome done = run(unit.device());
  EXPECT_EQ(done.exit_code, 0) << done.text;
  EXPECT_EQ(done.text, unit.device() + ": the unit is set up as wanted\n");
  EXPECT_EQ(encode_configuration(setup_of(unit)), encode_configuration(Stim300Setup{}));
  EXPECT_EQ(run("--check " + unit.device()).exit_code, 0);
}

// By the words that plumb-decode has, and in which a difference is told.
TEST(Stim300SetupTool, SetsTheUnitsThatItIsAskedFor) {
  Stim300OnPty unit({}, 1);
  const std::string wanted = " --gyro-unit rate --accel-unit acceleration ";
  const Outcome other = run("--check" + wanted + unit.device());
  EXPECT_NE(other.text.find("gyro unit is increment, wanted is rate\n"), std::string::npos) << other.text;
  EXPECT_NE(other.text.find("accelerometer unit is increment, wanted is acceleration\n"), std::string::npos);
  const Outcome done = run(wanted + unit.device());
  EXPECT_EQ(done.exit_code, 0) << done.text;
  EXPECT_EQ(setup_of(unit).gyro_unit, 8) << "rate, delayed";
  EXPECT_EQ(setup_of(unit).accel_unit, 0) << "acceleration";
  EXPECT_EQ(run("--gyro-unit acceleration " + unit.device()).text,
            "plumb-stim300-setup: --gyro-unit: 'acceleration' refused; expected one of average, increment, rate\n");
}

TEST(Stim300SetupTool, SavesWhenAskedTo) {
  for (const bool save : {false, true}) {
    Stim300OnPty unit({.rate_code = 0}, 1);
    ASSERT_EQ(run((save ? "--save " : "") + unit.device()).exit_code, 0);
    unit.with_unit([](Stim300Emulator& emulator) { emulator.restart(Stim300OnPty::now_ns()); });
    EXPECT_EQ(setup_of(unit).rate_code, save ? 1 : 0);
  }
}

TEST(Stim300SetupTool, SaysWhatIsWrong) {
  const Outcome nowhere = run("/dev/nonsense-tty");
  EXPECT_EQ(nowhere.exit_code, 2);
  EXPECT_NE(nowhere.text.find("/dev/nonsense-tty: cannot be opened"), std::string::npos);
  EXPECT_EQ(run("").exit_code, 2);
  EXPECT_EQ(run("--rate 300 /dev/null").exit_code, 2);
  const Outcome too_slow = run("--rate 2000 --baud 115200 /dev/null");
  EXPECT_EQ(too_slow.exit_code, 2);
  EXPECT_NE(too_slow.text.find("too slow"), std::string::npos);
  Stim300OnPty silent({}, 1);
  silent.with_unit([](Stim300Emulator& emulator) { emulator.faults().unplugged = true; });
  const Outcome unanswered = run(silent.device());
  EXPECT_EQ(unanswered.exit_code, 1);
  EXPECT_NE(unanswered.text.find("no answer to \"SERVICEMODE\""), std::string::npos) << unanswered.text;
  Stim300OnPty other_range({.accel_range_g = 30}, 1);
  const Outcome refused = run(other_range.device());
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.text.find("is 30, wanted is 10"), std::string::npos) << refused.text;
}

TEST(Stim300SetupTool, HasHelp) {
  const Outcome help = run("--help");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.text.find("--save"), std::string::npos);
}

}  // namespace
}  // namespace plumb::test
