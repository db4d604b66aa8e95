// The serial port on the system's own pseudo-terminals. They have no bits on a wire, but speed, format and queues.

#include "hal/linux/serial_port.h"

#include <gtest/gtest.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <string>
#include <vector>

#include "hal/linux/monotonic_clock.h"
#include "test/support/temporary_folder.h"
#include "tools/hil/pseudo_terminal.h"

namespace plumb::test {
namespace {

using hil::PseudoTerminal;
using Bytes = std::vector<std::uint8_t>;

constexpr Duration kSoon = Duration::from_ms(2000);

std::unique_ptr<LinuxSerialPort> open_port(const PseudoTerminal& line, const SerialOptions& options = {}) {
  std::string error;
  std::unique_ptr<LinuxSerialPort> port = LinuxSerialPort::open(line.device(), options, error);
  EXPECT_NE(port, nullptr) << error;
  return port;
}

std::string refusal(const std::string& device, const SerialOptions& options = {}) {
  std::string error;
  EXPECT_EQ(LinuxSerialPort::open(device, options, error), nullptr);
  return error;
}

TEST(LinuxSerialPort, SetsAnySpeed) {
  for (const std::uint32_t baud : {9600U, 374400U, 460800U, 921600U, 1843200U, 5184000U}) {
    const PseudoTerminal line;
    const auto port = open_port(line, {.baud = baud});
    EXPECT_EQ(line.baud(), baud);
  }
}

TEST(LinuxSerialPort, PassesEveryByteBothWays) {
  PseudoTerminal line;
  const auto port = open_port(line);
  Bytes all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  ASSERT_TRUE(line.write(all));
  Bytes received;
  while (received.size() < all.size()) {
    std::array<std::uint8_t, 100> buffer{};
    const Time before = clock_now();
    const Result<SerialChunk> chunk = port->read(buffer, kSoon);
    ASSERT_TRUE(chunk) << to_string(chunk.status());
    ASSERT_GT(chunk->size, 0U);
    EXPECT_GE(chunk->t, before);
    EXPECT_LE(chunk->t, clock_now());
    received.insert(received.end(), buffer.begin(), buffer.begin() + chunk->size);
  }
  EXPECT_EQ(received, all);
  ASSERT_EQ(port->write(all, kSoon), Status::kOk);
  EXPECT_EQ(line.read(), all);
}

TEST(LinuxSerialPort, WaitsNoLongerThanItIsTold) {
  const PseudoTerminal line;
  const auto port = open_port(line);
  std::array<std::uint8_t, 10> buffer{};
  const Time start = clock_now();
  EXPECT_EQ(port->read(buffer, Duration::from_ms(30)).status(), Status::kNotReady);
  const Duration waited = clock_now() - start;
  EXPECT_GE(waited, Duration::from_ms(30));
  EXPECT_LT(waited, Duration::from_ms(2000));  // whatever else the machine does
  EXPECT_EQ(port->read(buffer, Duration()).status(), Status::kNotReady);
  EXPECT_EQ(port->read(buffer, Duration::from_ms(-5)).status(), Status::kNotReady);
  EXPECT_EQ(port->read({}, Duration()).status(), Status::kInvalidValue);
}

TEST(LinuxSerialPort, TellsWhenThereIsNoRoomToWrite) {
  const PseudoTerminal line;  // nobody reads it
  const auto port = open_port(line);
  const Bytes much(1'000'000);
  const Time start = clock_now();
  EXPECT_EQ(port->write(much, Duration::from_ms(30)), Status::kFull);
  EXPECT_EQ(port->last_error(), EAGAIN);
  EXPECT_LT(clock_now() - start, Duration::from_ms(5000));
}

TEST(LinuxSerialPort, DropsWhatCameBeforeItWasOpened) {
  PseudoTerminal line;
  ASSERT_TRUE(line.write(Bytes{1, 2, 3, '\n'}));
  const auto port = open_port(line);
  ASSERT_TRUE(line.write(Bytes{7}));
  std::array<std::uint8_t, 10> buffer{};
  const Result<SerialChunk> chunk = port->read(buffer, kSoon);
  ASSERT_TRUE(chunk);
  EXPECT_EQ(chunk->size, 1U);
  EXPECT_EQ(buffer[0], 7);
}

TEST(LinuxSerialPort, ReportsALineThatIsGone) {
  PseudoTerminal line;
  const auto port = open_port(line);
  EXPECT_EQ(port->last_error(), 0);
  line.hang_up();
  std::array<std::uint8_t, 10> buffer{};
  EXPECT_EQ(port->read(buffer, kSoon).status(), Status::kRejected);
  EXPECT_NE(port->last_error(), 0);
  EXPECT_EQ(port->write(Bytes{1}, kSoon), Status::kRejected);
  EXPECT_NE(port->last_error(), 0);
}

// As a USB adapter that is pulled out and put back: another line under the same name, which udev makes a link.
TEST(LinuxSerialPort, ComesBackWhenTheLineIsThereAgain) {
  const TemporaryFolder folder;
  const std::filesystem::path name = folder.path() / "imu";
  std::array<std::uint8_t, 10> buffer{};
  std::string error;
  std::unique_ptr<LinuxSerialPort> port;
  const Time start = clock_now();
  {
    const PseudoTerminal line;
    std::filesystem::create_symlink(line.device(), name);
    port = LinuxSerialPort::open(name, {.baud = 460800}, error);
    ASSERT_NE(port, nullptr) << error;
  }
  EXPECT_EQ(port->read(buffer, kSoon).status(), Status::kRejected);
  EXPECT_EQ(port->read(buffer, kSoon).status(), Status::kRejected) << "not again at once";
  while (port->last_error() != ENOENT && clock_now() < start + kSoon) {
    EXPECT_EQ(port->read(buffer, Duration()).status(), Status::kRejected);
    wait_for(-1, 0, Duration::from_ms(5));
  }
  EXPECT_EQ(port->last_error(), ENOENT) << "why it does not come back";
  PseudoTerminal again;
  std::filesystem::remove(name);
  std::filesystem::create_symlink(again.device(), name);
  const Time end = clock_now() + kSoon;
  while (port->read(buffer, Duration()).status() == Status::kRejected && clock_now() < end) {
    wait_for(-1, 0, Duration::from_ms(5));
  }
  EXPECT_EQ(port->reopens(), 1U);
  EXPECT_EQ(again.baud(), 460800U);
  ASSERT_TRUE(again.write(Bytes{9}));
  ASSERT_TRUE(port->read(buffer, kSoon));
  EXPECT_EQ(buffer[0], 9);
}

TEST(LinuxSerialPort, RefusesWhatIsNoSerialLine) {
  EXPECT_EQ(refusal("/dev/plumb_no_such_device"),
            "/dev/plumb_no_such_device: cannot be opened: No such file or directory");
  EXPECT_EQ(refusal("/dev/null"), "/dev/null: cannot be set up as a serial line: Inappropriate ioctl for device");
}

TEST(LinuxSerialPort, RefusesALineThatIsTaken) {
  const PseudoTerminal line;
  const auto port = open_port(line);
  EXPECT_EQ(refusal(line.device()), line.device() + ": is in use by another program: Device or resource busy");
}

// A pseudo-terminal has no parity and silently leaves it off, as some drivers do with speeds.
TEST(LinuxSerialPort, NoticesWhatTheDriverSilentlyChanged) {
  const PseudoTerminal line;
  EXPECT_EQ(refusal(line.device(), {.parity = Parity::kEven}),
            line.device() + ": the driver has another number of data bits, stop bits or parity than asked for");
}

TEST(LinuxSerialPort, HasNoLowLatencyWhereTheDriverOffersNone) {
  const PseudoTerminal line;
  EXPECT_FALSE(open_port(line)->low_latency());
}

}  // namespace
}  // namespace plumb::test
