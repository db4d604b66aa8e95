// Pixel formats of bridges against the emulated sensor's own layouts, and images that are none.

#include "hal/linux/grey_image.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "test/emulators/ov7251/ov7251_emulator.h"
#include "test/support/property.h"

namespace plumb {
namespace {

using emulator::Ov7251Emulator;
using emulator::Ov7251Image;
using Bytes = std::vector<std::uint8_t>;

std::vector<std::uint8_t> pixels_of(const ImageView& image) {
  std::vector<std::uint8_t> pixels;
  for (std::int32_t v = 0; v < image.height; ++v) {
    const std::uint8_t* const row = image.pixels + static_cast<std::ptrdiff_t>(v) * image.stride;
    pixels.insert(pixels.end(), row, row + image.width);
  }
  return pixels;
}

TEST(GreyImage, TakesTheUpperEightBitsOfEveryFormat) {
  Ov7251Emulator sensor(0, test::base_seed());
  sensor.world.noise_counts = 200.0;
  const Ov7251Image image = *sensor.next_image();
  const Bytes expected = as_grey(image);
  for (const int padding : {0, 1, 24}) {
    const struct {
      GreyFormat format;
      Bytes bytes;
      int row;
    } cases[] = {{GreyFormat::kGrey, as_grey(image, padding), 640},
                 {GreyFormat::kY10, as_y10(image, padding), 1280},
                 {GreyFormat::kY10Packed, as_y10_packed(image, padding), 800}};
    for (const auto& [format, bytes, row] : cases) {
      Bytes unpacked;
      const Result<ImageView> grey =
          to_grey({.format = format, .width = 640, .height = 480, .stride = row + padding, .bytes = bytes}, unpacked);
      ASSERT_TRUE(grey);
      EXPECT_EQ(pixels_of(*grey), expected) << static_cast<int>(format) << " padded by " << padding;
    }
  }
}

TEST(GreyImage, TakesTheReferenceVector) {
  const Bytes packed = {0xFF, 0x80, 0x00, 0x40, 0x73};
  const Bytes y10 = {0xFF, 0x03, 0x00, 0x02, 0x03, 0x00, 0x01, 0x01};
  Bytes unpacked;
  for (const auto& [format, bytes] : {std::pair{GreyFormat::kY10Packed, packed}, std::pair{GreyFormat::kY10, y10}}) {
    const auto stride = static_cast<std::int64_t>(bytes.size());
    const Result<ImageView> grey =
        to_grey({.format = format, .width = 4, .height = 1, .stride = stride, .bytes = bytes}, unpacked);
    ASSERT_TRUE(grey);
    EXPECT_EQ(pixels_of(*grey), (Bytes{255, 128, 0, 64}));
  }
}

TEST(GreyImage, ReadsNoByteThatIsNotThere) {
  test::for_all(5000, [](test::Generator& g) {
    const auto edge = [&g](std::int64_t low, std::int64_t high) -> std::int64_t {
      return g.integer(0, 9) == 0
                 ? g.integer(std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max())
                 : g.integer(low, high);
    };
    // A heap block of the very size, so that the address sanitizer sees a byte too many.
    const Bytes bytes(static_cast<std::size_t>(g.integer(0, 400)), 7);
    Bytes unpacked;
    const RawImage raw{.format = static_cast<GreyFormat>(g.integer(0, 2)),
                       .width = static_cast<std::int32_t>(edge(-1, 20)),
                       .height = static_cast<std::int32_t>(edge(-1, 20)),
                       .stride = edge(-1, 45),
                       .bytes = bytes};
    const Result<ImageView> grey = to_grey(raw, unpacked);
    if (!grey) return;
    for (const std::uint8_t pixel : pixels_of(*grey)) ASSERT_LE(pixel, 193);  // of bytes that are all 7
    ASSERT_GE(raw.stride, row_bytes(raw.format, raw.width));
  });
}

}  // namespace
}  // namespace plumb
