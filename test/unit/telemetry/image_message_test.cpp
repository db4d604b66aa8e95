// The image message is written by hand in flight; here it meets the type that lcm-gen makes.

#include <gtest/gtest.h>

#include <vector>

#include "fsw/telemetry/messages.h"
#include "plumb_lcm/plumb/image_t.hpp"

namespace plumb {
namespace {

constexpr std::int32_t kWidth = 5;
constexpr std::int32_t kHeight = 3;
constexpr std::int32_t kStride = 8;

struct Picture {
  Picture() {
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint8_t>(i * 7);
    frame = {.t_exposure_mid = Time::from_ns(1'403'636'584'763'555'584),
             .sequence = 0x80000001U,
             .image = {.pixels = pixels.data(), .width = kWidth, .height = kHeight, .stride = kStride}};
  }
  std::vector<std::uint8_t> pixels = std::vector<std::uint8_t>(kStride * kHeight);
  CameraFrame frame;
};

std::vector<std::uint8_t> encoded(const CameraFrame& frame) {
  std::vector<std::uint8_t> buffer(kImageHeaderBytes + kWidth * kHeight);
  const Result<std::size_t> size = encode(frame, buffer);
  EXPECT_TRUE(size.has_value());
  EXPECT_EQ(size.value(), buffer.size());
  return buffer;
}

TEST(ImageMessage, IsWhatTheGeneratedTypeWrites) {
  const Picture picture;
  image_t generated;
  generated.time_ns = picture.frame.t_exposure_mid.ns();
  generated.sequence = static_cast<std::int32_t>(picture.frame.sequence);
  generated.width = kWidth;
  generated.height = kHeight;
  generated.size = kWidth * kHeight;
  for (std::size_t row = 0; row < kHeight; ++row) {
    const std::uint8_t* start = picture.pixels.data() + row * kStride;
    generated.pixels.insert(generated.pixels.end(), start, start + kWidth);
  }
  std::vector<std::uint8_t> expected(static_cast<std::size_t>(generated.getEncodedSize()));
  generated.encode(expected.data(), 0, static_cast<int>(expected.size()));
  EXPECT_EQ(encoded(picture.frame), expected);
}

TEST(ImageMessage, ComesBack) {
  const Picture picture;
  const std::vector<std::uint8_t> bytes = encoded(picture.frame);
  CameraFrame back;
  ASSERT_EQ(decode(bytes, back), Status::kOk);
  EXPECT_EQ(back.t_exposure_mid, picture.frame.t_exposure_mid);
  EXPECT_EQ(back.sequence, picture.frame.sequence);
  ASSERT_EQ(back.image.width, kWidth);
  ASSERT_EQ(back.image.height, kHeight);
  for (std::int32_t row = 0; row < kHeight; ++row) {
    for (std::int32_t column = 0; column < kWidth; ++column) {
      EXPECT_EQ(back.image.pixels[row * back.image.stride + column],
                picture.pixels[static_cast<std::size_t>(row * kStride + column)]);
    }
  }
}

TEST(ImageMessage, EverythingElseIsRefused) {
  const Picture picture;
  const std::vector<std::uint8_t> whole = encoded(picture.frame);
  CameraFrame frame;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_EQ(decode(MessageBytes(whole.data(), size), frame), Status::kInvalidValue);
  }
  for (const std::size_t byte : {std::size_t{0}, std::size_t{23}, std::size_t{27}, std::size_t{31}}) {
    std::vector<std::uint8_t> wrong = whole;  // fingerprint, width, height, size
    wrong[byte] ^= 1U;
    EXPECT_EQ(decode(wrong, frame), Status::kInvalidValue) << byte;
  }
}

TEST(ImageMessage, NeedsPixelsAndRoom) {
  const Picture picture;
  std::vector<std::uint8_t> small(kImageHeaderBytes + kWidth * kHeight - 1);
  EXPECT_EQ(encode(picture.frame, small).status(), Status::kFull);
  EXPECT_EQ(encode(picture.frame, MessageBuffer()).status(), Status::kFull);
  CameraFrame empty = picture.frame;
  empty.image = {};
  EXPECT_EQ(encode(empty, small).status(), Status::kInvalidValue);
}

}  // namespace
}  // namespace plumb
