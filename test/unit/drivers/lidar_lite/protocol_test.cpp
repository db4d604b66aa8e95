// The state machine against a device that says anything.

#include "drivers/lidar_lite/protocol.h"

#include <gtest/gtest.h>

#include "test/emulators/lidar_lite/lidar_lite_emulator.h"
#include "test/support/property.h"

namespace plumb::lidar_lite {
namespace {

Model any_model(test::Generator& g) { return static_cast<Model>(g.integer(0, 2)); }

TEST(LidarLiteProtocol, BeginsWithAResetAndWaits) {
  Protocol protocol({});
  const Time start = Time::from_ns(1'000'000);
  const Request request = protocol.next(start);
  ASSERT_EQ(request.kind, Request::Kind::kWrite);
  ASSERT_EQ(request.bytes.size(), 2U);
  EXPECT_EQ(request.bytes[0], 0x00);
  EXPECT_EQ(request.bytes[1], 0x00);
  Transfer done{.t_stop = start, .is_read = false, .acknowledged = true, .bytes = {}};
  (void)done.bytes.push_back(0x00);
  (void)done.bytes.push_back(0x00);
  EXPECT_EQ(protocol.complete(done).status(), Status::kNotReady);
  EXPECT_EQ(protocol.wake(), start + kResetPause);
  EXPECT_EQ(protocol.next(start + kResetPause - Duration::from_ns(1)).kind, Request::Kind::kWait);
  EXPECT_EQ(protocol.next(start + kResetPause).kind, Request::Kind::kWrite);
  EXPECT_FALSE(protocol.measuring());
}

TEST(LidarLiteProtocolDeathTest, OptionsOutOfLimitsAreABug) {
  EXPECT_DEATH(Protocol({.period = Duration::from_ms(9)}), "");
  EXPECT_DEATH(Protocol({.bias_period = 0}), "");
  EXPECT_DEATH(Protocol({.bias_period = 101}), "");
}

struct Driven {
  explicit Driven(const Options& options) : protocol(options) {}

  // Answers the next request, if any, by the function (bytes to fill if read; false: no acknowledge).
  template <typename Answer>
  Result<RangeSample> step(Answer answer) {
    const Request request = protocol.next(now);
    if (request.kind == Request::Kind::kWait) {
      EXPECT_GT(protocol.wake(), now);
      EXPECT_LE(protocol.wake() - now, kMaxBackOffPause) << "a pause without end";
      now = protocol.wake();
      return Status::kNotReady;
    }
    now = now + Duration::from_us(75);
    Transfer transfer{
        .t_stop = now, .is_read = request.kind == Request::Kind::kRead, .acknowledged = false, .bytes = {}};
    if (transfer.is_read) {
      EXPECT_GE(request.size, 1);
      EXPECT_LE(request.size, 2);
      transfer.bytes.resize(request.size);
    } else {
      EXPECT_FALSE(request.bytes.empty());
      for (const std::uint8_t byte : request.bytes) (void)transfer.bytes.push_back(byte);
    }
    transfer.acknowledged = answer(transfer);
    return protocol.complete(transfer);
  }

  Protocol protocol;
  Time now = Time::from_ns(1'000'000'000);
};

// Any register values and any refusals: the machine goes on asking, its pauses are bounded, what it takes for a range
// lies within the model's reach, and a device that is well again is measured with within a bounded time.
TEST(LidarLiteProtocol, NeverStallsWhateverTheRegistersSay) {
  test::for_all(400, [](test::Generator& g) {
    const Model model = any_model(g);
    Driven driven({.model = model, .bias_period = static_cast<int>(g.integer(1, kMaxBiasPeriod))});
    // Between 0 and 1, so that every stage of the machine is reached by some cases.
    const double acknowledged = g.uniform(0.0, 1.0);
    const double plausible = g.uniform(0.0, 1.0);
    const auto answer = [&](Transfer& transfer) {
      if (transfer.is_read) {
        const bool kind = g.uniform(0.0, 1.0) < plausible;
        constexpr std::uint8_t kKind[] = {0x00, 0x08, 0x10, 0x20, 0x28, 0x80};
        for (std::uint8_t& byte : transfer.bytes) {
          byte = kind ? kKind[g.integer(0, 5)] : static_cast<std::uint8_t>(g.integer(0, 255));
        }
      }
      return g.uniform(0.0, 1.0) < acknowledged;
    };
    const double reach_m = model == Model::kV4Led ? 10.0 : 40.0;
    for (int i = 0; i < 3000; ++i) {
      const Result<RangeSample> sample = driven.step(answer);
      if (sample && sample->quality == RangeQuality::kValid) {
        ASSERT_GE(sample->range_m, 0.05);
        ASSERT_LE(sample->range_m, reach_m);
        ASSERT_LT(sample->t, driven.now);
        ASSERT_GE(sample->t, driven.now - kMaxAcquisition - Duration::from_ms(5));
      }
    }

    test::LidarLiteEmulator device(static_cast<test::LidarLiteEmulator::Kind>(model));
    device.set_range_m(6.5);
    const auto good = [&](Transfer& transfer) {
      const std::span<std::uint8_t> bytes(transfer.bytes.data(), transfer.bytes.size());
      return transfer.is_read ? device.read(kAddress, bytes, driven.now.ns())
                              : device.write(kAddress, bytes, driven.now.ns());
    };
    const Time well = driven.now;
    const Duration limit = kMaxBackOffPause + kMaxAcquisition + kResetPause + Duration::from_ms(60);
    Result<RangeSample> sample = Status::kNotReady;
    while (!(sample && sample->quality == RangeQuality::kValid)) {
      sample = driven.step(good);
      ASSERT_LE(driven.now - well, limit) << "no range from a device that is well";
    }
    EXPECT_DOUBLE_EQ(sample->range_m, 6.5);
  });
}

TEST(LidarLiteProtocol, AClockThatJumpsAheadDoesNotBringABurst) {
  Driven driven({.model = Model::kV3});
  test::LidarLiteEmulator device(test::LidarLiteEmulator::Kind::kV3);
  const auto good = [&](Transfer& transfer) {
    const std::span<std::uint8_t> bytes(transfer.bytes.data(), transfer.bytes.size());
    return transfer.is_read ? device.read(kAddress, bytes, driven.now.ns())
                            : device.write(kAddress, bytes, driven.now.ns());
  };
  for (int i = 0; i < 500; ++i) (void)driven.step(good);
  driven.now = driven.now + Duration::from_ms(5000);
  const int before = device.measurements();
  const Time end = driven.now + Duration::from_ms(1000);
  while (driven.now < end) (void)driven.step(good);
  EXPECT_LE(device.measurements() - before, 27);
  EXPECT_GE(device.measurements() - before, 20);
}

}  // namespace
}  // namespace plumb::lidar_lite
