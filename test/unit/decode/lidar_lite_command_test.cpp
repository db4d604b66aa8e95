// plumb-decode lidar-lite: what the kernel's tracing says of an emulated device's bus, back to the ranges it was told.

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <string>
#include <vector>

#include "drivers/lidar_lite/device.h"
#include "test/emulators/lidar_lite/lidar_lite_bus.h"
#include "test/support/temporary_folder.h"
#include "test/unit/decode/decoded.h"

namespace plumb::test {
namespace {

/// A bus that writes down each transfer as the kernel's events do.
class TracedBus final : public I2cBus {
 public:
  explicit TracedBus(LidarLiteBus& bus) : bus_(bus) {}
  Result<Time> write(std::uint8_t address, std::span<const std::uint8_t> bytes) override {
    note("i2c_write: i2c-1 #0 a=%s f=0000 l=%zu [%s]", address, bytes);
    return finish(bus_.write(address, bytes));
  }
  Result<Time> read(std::uint8_t address, std::span<std::uint8_t> bytes) override {
    note("i2c_read: i2c-1 #0 a=%s f=0001 l=%zu", address, bytes);
    const Result<Time> stop = bus_.read(address, bytes);
    if (stop) note("i2c_reply: i2c-1 #0 a=%s f=0001 l=%zu [%s]", address, bytes);
    return finish(stop);
  }
  bool is_gone() const override { return bus_.is_gone(); }
  int last_error() const override { return bus_.last_error(); }
  void add(const std::string& line) { text_ += line + "\n"; }
  const std::string& text() const { return text_; }

 private:
  void line(const std::string& event) {
    std::array<char, 64> begin{};
    const std::int64_t us = bus_.now().ns() / 1000;
    std::snprintf(begin.data(), begin.size(),
                  "      plumb-fsw-812     [001] ..... %5lld.%06lld: ", static_cast<long long>(us / 1'000'000),
                  static_cast<long long>(us % 1'000'000));
    add(begin.data() + event);
  }
  void note(const char* format, std::uint8_t address, std::span<const std::uint8_t> bytes) {
    std::string hex;
    std::array<char, 8> digits{};
    for (const std::uint8_t byte : bytes) {
      std::snprintf(digits.data(), digits.size(), hex.empty() ? "%02x" : "-%02x", byte);
      hex += digits.data();
    }
    std::snprintf(digits.data(), digits.size(), "%03x", address);
    std::array<char, 128> event{};
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    std::snprintf(event.data(), event.size(), format, digits.data(), bytes.size(), hex.c_str());
#pragma GCC diagnostic pop
    line(event.data());
  }
  Result<Time> finish(const Result<Time>& stop) {
    line(stop ? "i2c_result: i2c-1 n=1 ret=1" : "i2c_result: i2c-1 n=1 ret=-6");
    return stop;
  }

  LidarLiteBus& bus_;
  std::string text_ = "# tracer: nop\n#\n";
};

class DecodeLidarLite : public ::testing::Test {
 protected:
  std::string file(const std::string& text) const { return folder_.write("trace.txt", text).string(); }
  TemporaryFolder folder_;
};

TEST_F(DecodeLidarLite, PrintsTheRangesOfTheDevice) {
  LidarLiteEmulator unit(LidarLiteEmulator::Kind::kV3);
  unit.set_range_m(7.65);
  LidarLiteBus bus(unit);
  TracedBus traced(bus);
  lidar_lite::Device device(traced, {});
  std::vector<RangeSample> samples;
  traced.add("   other-1 [000] ..... 0.000100: i2c_write: i2c-1 #0 a=029 f=0000 l=1 [00]");
  traced.add("   other-1 [000] ..... 0.000200: i2c_result: i2c-1 n=1 ret=1");
  traced.add("   other-1 [000] ..... 0.0003: i2c_reply: nonsense");
  traced.add("   sh-1 [000] ..... 0.000400: sched_switch: prev_comm=sh");  // beside the two of the trace's head
  traced.add("");
  while (samples.size() < 20) {
    bus.wait_until(device.wake());
    const Result<RangeSample> sample = device.poll(bus.now());
    if (sample) samples.push_back(*sample);
  }
  const Decoded result = decode("lidar-lite " + file(traced.text()));
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_EQ(result.header, "t_s,distance_m,quality,strength,status");
  ASSERT_EQ(result.rows.size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_NEAR(std::stod(result.rows[i]), samples[i].t.seconds(), 2e-6);
    EXPECT_NE(result.rows[i].find(",7.65,valid,"), std::string::npos) << result.rows[i];
  }
  EXPECT_NE(result.error.find("plumb-decode: 20 ranges, 0 without return, 0 weak, 0 not ready, 0 never read; "),
            std::string::npos);
  EXPECT_NE(result.error.find(", 1 other transfers, 1 lines that could not be read, 4 other lines\n"),
            std::string::npos)
      << result.error;
}

TEST_F(DecodeLidarLite, SaysWhatIsWrong) {
  const Decoded none = decode("lidar-lite " + file("no trace\n   a-1 [000] ..... 0.0003: i2c_reply: nonsense\n"));
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.error.find("no measurement; "), std::string::npos);
  EXPECT_NE(none.error.find(", 0 other transfers, 1 lines that could not be read, 1 other lines\n"), std::string::npos)
      << none.error;
  EXPECT_EQ(decode("lidar-lite --model v5 " + file("")).exit_code, 2);
  EXPECT_EQ(decode("lidar-lite --model v5 " + file("")).error,
            "plumb-decode: --model: 'v5' refused; expected one of v3, v3hp, v4led\n");
  EXPECT_EQ(decode("lidar-lite --help").exit_code, 0);
}

}  // namespace
}  // namespace plumb::test
