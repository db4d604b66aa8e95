#include "fsw/base/crc32.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "test/support/property.h"

namespace plumb {
namespace {

// The check value of the catalogue of parametrised CRC algorithms, CRC-32/ISO-HDLC.
TEST(Crc32, IsTheOneOfTheCatalogue) {
  constexpr std::array<std::uint8_t, 9> kDigits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  static_assert(crc32(kDigits) == 0xCBF43926U);
  EXPECT_EQ(crc32({}), 0U);
}

TEST(Crc32, TellsEveryBurstOfUpTo32Bits) {
  test::for_all(500, [](test::Generator& g) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(g.integer(4, 60)));
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(g.bits());
    const std::uint32_t sound = crc32(bytes);
    const auto at = static_cast<std::size_t>(g.integer(0, static_cast<std::int64_t>(bytes.size()) - 4));
    const std::uint64_t burst = g.bits() | 1U;
    for (std::size_t i = 0; i < 4; ++i) bytes[at + i] ^= static_cast<std::uint8_t>(burst >> 8 * i);
    EXPECT_NE(crc32(bytes), sound);
  });
}

}  // namespace
}  // namespace plumb
