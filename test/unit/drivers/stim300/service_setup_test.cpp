#include "drivers/stim300/service_setup.h"

#include <gtest/gtest.h>

#include <string>

#include "test/support/property.h"
#include "test/unit/drivers/stim300/session.h"

namespace plumb::test {
namespace {

using emulator::Stim300Emulator;
using emulator::Stim300Setup;
using stim300::ServiceSetup;

// The dialogue with a running unit; returns what was sent, commands separated by CR.
std::string talk(ServiceSetup& setup, Stim300Emulator& unit) {
  std::string sent;
  for (std::int64_t t_ns = kSwitchedOn_ns + 500 * kMs; t_ns < kSwitchedOn_ns + 30'000 * kMs; t_ns += 10 * kMs) {
    for (const emulator::Transmission& t : unit.run_until(t_ns)) setup.receive(t.bytes, Time::from_ns(t_ns));
    const ServiceSetup::Command command = setup.poll(Time::from_ns(t_ns));
    sent.append(command.begin(), command.end());
    unit.receive(command, t_ns);
    if (setup.status() != Status::kNotReady) break;
  }
  return sent;
}

TEST(Stim300ServiceSetup, SendsTheCommandsOfTheDataSheet) {
  Stim300Emulator unit({}, kSwitchedOn_ns, 1);
  ServiceSetup setup({.temperatures = true}, true);
  EXPECT_EQ(talk(setup, unit), "SERVICEMODE\rm 1\rd 5,0\ru g,9\ru a,1\rf 4,g\rf 4,a\rs\rY\rx N\r");
  EXPECT_EQ(setup.status(), Status::kOk);
  EXPECT_FALSE(unit.in_service_mode());
}

// From any setup to any other that is usable: afterwards the unit is what was asked for, and stays so if it was saved.
TEST(Stim300ServiceSetup, SetsAUnitUp) {
  for_all(100, [](Generator& g) {
    const auto any = [&g] {
      return Stim300Setup{.rate_code = static_cast<int>(g.integer(0, 3)),
                          .inclinometer = g.integer(0, 1) == 1,
                          .temperatures = g.integer(0, 1) == 1,
                          .pps = g.integer(0, 1) == 1,
                          .cr_lf = g.integer(0, 1) == 1,
                          .gyro_unit = static_cast<int>(g.integer(0, 2) + 8 * g.integer(0, 1)),
                          .accel_unit = static_cast<int>(g.integer(0, 2)),
                          .gyro_filter = static_cast<int>(g.integer(0, 4)),
                          .accel_filter = static_cast<int>(g.integer(0, 4))};
    };
    const Stim300Setup before = any();
    const Stim300Setup wanted = any();
    const bool save = g.integer(0, 1) == 1;
    Stim300Emulator unit(before, kSwitchedOn_ns, g.bits());
    ServiceSetup setup(settings_of(wanted), save);
    const std::string sent = talk(setup, unit);
    ASSERT_EQ(setup.status(), Status::kOk) << sent;
    ASSERT_EQ(emulator::encode_configuration(unit.setup()), emulator::encode_configuration(wanted));
    unit.restart(0);
    ASSERT_EQ(emulator::encode_configuration(unit.setup()), emulator::encode_configuration(save ? wanted : before));
  });
}

TEST(Stim300ServiceSetup, TellsWhatTheUnitRefused) {
  // A line that is not as fast as the settings say.
  Stim300Emulator unit({.baud = 115200}, kSwitchedOn_ns, 1);
  ServiceSetup setup({.rate_hz = 2000}, true);
  talk(setup, unit);
  EXPECT_EQ(setup.status(), Status::kRejected);
  EXPECT_EQ(setup.error_code(), 7);
  EXPECT_EQ(std::string(setup.command().begin(), setup.command().end()), "m 4\r");
}

TEST(Stim300ServiceSetup, GivesUpOnAUnitThatDoesNotAnswer) {
  Stim300Emulator unit({}, kSwitchedOn_ns, 1);
  unit.faults().unplugged = true;
  ServiceSetup setup({}, false);
  EXPECT_EQ(talk(setup, unit), "SERVICEMODE\r");
  EXPECT_EQ(setup.status(), Status::kStale);
}

// The emulator refuses what the unit would refuse: else it would prove nothing.
TEST(Stim300ServiceSetup, TheEmulatorRefusesMalformedCommands) {
  Stim300Emulator unit({}, kSwitchedOn_ns, 1);
  auto ask = [&unit, t_ns = kSwitchedOn_ns + 500 * kMs](const std::string& text) mutable {
    const emulator::Bytes bytes(text.begin(), text.end());
    (void)unit.run_until(t_ns);
    unit.receive(bytes, t_ns);
    t_ns += 100 * kMs;
    std::string reply;
    for (const emulator::Transmission& t : unit.run_until(t_ns)) reply.append(t.bytes.begin(), t.bytes.end());
    return reply;
  };
  EXPECT_EQ(ask("SERVICEMODE\r").substr(0, 13), "SERVICEMODE\r>");
  EXPECT_EQ(ask("m 1\r"), "m 1\r\r>");
  EXPECT_EQ(ask("M 1\r"), "M 1\rE001 UNKNOWN COMMAND\r>");
  EXPECT_EQ(ask("m 1,2\r"), "m 1,2\rE002 INVALID NUMBER OF PARAMETERS\r>");
  EXPECT_EQ(ask("m 9\r"), "m 9\rE003 INVALID PARAMETER\r>");
  EXPECT_EQ(ask("u g,c\r"), "u g,c\rE003 INVALID PARAMETER\r>");
  EXPECT_EQ(ask("d 7,0\r").substr(0, 6), "d 7,0\r");
}

}  // namespace
}  // namespace plumb::test
