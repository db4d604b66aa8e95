// Frames in, camera frames out: sizes, order, gaps and stamps, one frame at a time.

#include "drivers/ov7251/protocol.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <vector>

namespace plumb::ov7251 {
namespace {

class Ov7251Protocol : public ::testing::Test {
 protected:
  Ov7251Protocol() { protocol_.start(kPeriod); }

  PortFrame frame(std::int64_t index, std::uint32_t sequence) {
    pixels_.assign(static_cast<std::size_t>(kWidth * kHeight), 90);
    pixels_[4 * (kWidth + 1)] = static_cast<std::uint8_t>(index);  // what noise does
    return {.image = {pixels_.data(), kWidth, kHeight, kWidth},
            .t = Time::from_ns(1'000'000'000) + kPeriod * index,
            .sequence = sequence};
  }
  PortFrame next() {
    ++index_;
    return frame(index_, static_cast<std::uint32_t>(index_));
  }

  static constexpr Duration kPeriod = Duration::from_ns(33'330'092);
  Protocol protocol_{{.auto_exposure = false}};
  std::vector<std::uint8_t> pixels_;
  std::int64_t index_ = 0;
};

TEST_F(Ov7251Protocol, AsksForTheNearestModeOfTheSensor) {
  const struct {
    std::int64_t asked_us;
    std::int32_t lines;
  } cases[] = {{33'333, 1724}, {50'000, 1724}, {16'667, 860}, {11'000, 572}, {1'000, 572}};
  for (const auto& [asked_us, lines] : cases) {
    const Protocol protocol({.period = Duration::from_us(asked_us)});
    EXPECT_EQ(protocol.mode().period, kLineTime * lines);
    EXPECT_EQ(protocol.mode().width, 640);
  }
  const Protocol triggered({.period = Duration::from_ms(50), .trigger = CameraTrigger::kExternal});
  EXPECT_EQ(triggered.mode().period, Duration::from_ms(50));
}

TEST_F(Ov7251Protocol, RefusesImagesOfAnotherSize) {
  PortFrame odd = next();
  odd.image.height = 400;
  EXPECT_EQ(protocol_.on_frame(odd).status(), Status::kRejected);
  EXPECT_EQ(protocol_.counters().wrong_size, 1U);
  EXPECT_EQ(protocol_.counters().wrong_size.value, std::int64_t{kWidth} << 32U | 400);
  EXPECT_TRUE(protocol_.on_frame(next()));
}

TEST_F(Ov7251Protocol, RefusesWhatIsNotLater) {
  ASSERT_TRUE(protocol_.on_frame(next()));
  ASSERT_TRUE(protocol_.on_frame(frame(2, 2)));
  EXPECT_EQ(protocol_.on_frame(frame(2, 3)).status(), Status::kOutOfOrder);
  EXPECT_EQ(protocol_.on_frame(frame(1, 4)).status(), Status::kOutOfOrder);
  EXPECT_EQ(protocol_.counters().out_of_order, 2U);
  EXPECT_EQ(protocol_.counters().out_of_order.value, 4) << "the sequence of the source";
  EXPECT_TRUE(protocol_.on_frame(frame(3, 5)));
}

TEST_F(Ov7251Protocol, CountsLostFramesByTimeWhereTheSequenceHasNoGaps) {
  ASSERT_EQ(protocol_.on_frame(frame(1, 7))->sequence, 7U);
  EXPECT_EQ(protocol_.on_frame(frame(4, 8))->sequence, 10U);
  EXPECT_EQ(protocol_.counters().lost, 2U);
  EXPECT_EQ(protocol_.counters().lost.value, 2);
}

TEST_F(Ov7251Protocol, CountsLostFramesByTheSequence) {
  ASSERT_TRUE(protocol_.on_frame(frame(1, 1)));
  PortFrame late = frame(2, 4);  // stamped by a source that was late once
  EXPECT_EQ(protocol_.on_frame(late)->sequence, 4U);
  EXPECT_EQ(protocol_.counters().lost, 2U);
}

TEST_F(Ov7251Protocol, CountsNoLossWhenASourceBeginsAnew) {
  ASSERT_EQ(protocol_.on_frame(frame(1, 5000))->sequence, 5000U);
  EXPECT_EQ(protocol_.on_frame(frame(2, 0))->sequence, 5001U);
  EXPECT_EQ(protocol_.counters().lost, 0U);
}

TEST_F(Ov7251Protocol, TakesNoGapFromArrivals) {
  PortFrame first = frame(1, 1);
  first.stamp = CameraStamp::kArrival;
  ASSERT_TRUE(protocol_.on_frame(first));
  PortFrame late = frame(4, 2);
  late.stamp = CameraStamp::kArrival;
  ASSERT_TRUE(protocol_.on_frame(late));
  EXPECT_EQ(protocol_.counters().lost, 0U);
  EXPECT_EQ(protocol_.counters().unstamped, 2U);
}

TEST_F(Ov7251Protocol, RefusesADamagedImageAndKeepsItsPlace) {
  PortFrame damaged = next();
  damaged.damaged = true;
  EXPECT_EQ(protocol_.on_frame(damaged).status(), Status::kRejected);
  EXPECT_EQ(protocol_.counters().damaged, 1U);
  EXPECT_TRUE(protocol_.on_frame(next()));
  EXPECT_EQ(protocol_.counters().lost, 0U);
}

TEST_F(Ov7251Protocol, RefusesARepeatedImageUnlessItIsFlat) {
  ASSERT_TRUE(protocol_.on_frame(next()));
  PortFrame again = next();
  pixels_[4 * (kWidth + 1)] = 1;  // as the first
  EXPECT_EQ(protocol_.on_frame(again).status(), Status::kRejected);
  EXPECT_EQ(protocol_.counters().repeated, 1U);
  for (int i = 0; i < 2; ++i) {
    PortFrame dark = next();
    std::fill(pixels_.begin(), pixels_.end(), std::uint8_t{0});
    EXPECT_TRUE(protocol_.on_frame(dark));
  }
}

TEST_F(Ov7251Protocol, StampsTheMiddleOfTheExposureWhateverIsStamped) {
  const Duration exposure = Duration::from_us(4'000);
  const Duration readout = kLineTime * 480;
  const auto middle = [&](CameraStamp stamp) {
    Protocol protocol({.auto_exposure = false, .arrival_delay = Duration::from_us(300)});
    protocol.start(kPeriod);
    PortFrame stamped = next();
    stamped.t = Time::from_seconds(10.0);
    stamped.stamp = stamp;
    stamped.has_exposure = true;
    stamped.exposure = {.time = exposure, .gain = 1.0};
    return protocol.on_frame(stamped)->t_exposure_mid;
  };
  const Time t = Time::from_seconds(10.0);
  EXPECT_EQ(middle(CameraStamp::kEndOfFrame), t - readout - Duration::from_us(2'000));
  EXPECT_EQ(middle(CameraStamp::kStartOfExposure), t + Duration::from_us(2'000));
  EXPECT_EQ(middle(CameraStamp::kArrival), t - Duration::from_us(300) - readout - Duration::from_us(2'000));
  EXPECT_EQ(middle(CameraStamp::kEndOfExposure), t - Duration::from_us(2'000));
}

TEST_F(Ov7251Protocol, AsksAgainForAnExposureThatWasRefused) {
  Protocol protocol({.auto_exposure = false});
  protocol.start(kPeriod);
  const Exposure first = protocol.wanted();
  ASSERT_GT(first.time, Duration());
  protocol.on_exposure_refused(EIO);
  EXPECT_EQ(protocol.wanted().time, Duration());
  ASSERT_TRUE(protocol.on_frame(next()));
  EXPECT_EQ(protocol.wanted(), first);
  EXPECT_EQ(protocol.counters().refused, 1U);
  EXPECT_EQ(protocol.counters().refused.value, EIO);
}

// Its gain ends before the light does: the same again would change nothing.
TEST_F(Ov7251Protocol, AsksOnceForWhatTheCameraHasNot) {
  Protocol protocol({});
  protocol.start(kPeriod);
  int last_asked = -1;
  for (int i = 0; i < 60; ++i) {
    PortFrame dark = next();
    std::fill(pixels_.begin(), pixels_.end(), static_cast<std::uint8_t>(5));
    if (protocol.wanted().time > Duration()) {
      const Exposure taken = {.time = protocol.wanted().time, .gain = std::min(protocol.wanted().gain, 2.0)};
      protocol.on_exposure_set(taken, dark.t);
      last_asked = i;
    }
    ASSERT_TRUE(protocol.on_frame(dark));
  }
  EXPECT_EQ(protocol.exposure().gain, 2.0);
  EXPECT_GT(last_asked, 0);
  EXPECT_LT(last_asked, 40);
}

}  // namespace
}  // namespace plumb::ov7251
