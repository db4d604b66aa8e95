#pragma once
// Datagrams whose bytes and meaning are known. R: captured from a real unit (UBC-Rocket/Whistler-Blackcomb-v2, MIT
// licence; rate, acceleration and inclination, CR LF, a 30 g part). A to F: computed from the data sheet, with a
// checksum implementation that is neither the driver's nor the emulator's.

#include <cstdint>
#include <string_view>
#include <vector>

namespace plumb::test {

using Bytes = std::vector<std::uint8_t>;

inline Bytes from_hex(std::string_view text) {
  const auto digit = [](char c) { return static_cast<unsigned>(c <= '9' ? c - '0' : c - 'a' + 10); };
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 3) {
    bytes.push_back(static_cast<std::uint8_t>(digit(text[i]) << 4U | digit(text[i + 1])));
  }
  return bytes;
}

inline Bytes without_cr_lf(Bytes bytes) {
  bytes.resize(bytes.size() - 2);
  return bytes;
}

inline constexpr std::string_view kR1 =
    "93 ff fb db 00 00 7c ff fc c4 00 00 05 ce 00 01 f6 04 0e 54 00 00 53 9d ff b2 b7 40 2d 99 00 41 01 fb 60 73 e3 de "
    "0d 0a";
inline constexpr std::string_view kR2 =
    "93 00 01 82 00 04 73 ff f7 5c 00 00 07 b2 ff f8 7e 04 05 bf 00 00 61 0a ff d8 d2 40 13 94 00 51 01 fa 8c 3d 47 0f "
    "0d 0a";
inline constexpr std::string_view kR3 =
    "93 ff fb 9d ff fc c1 00 04 0d 00 00 03 18 00 01 04 04 04 3e 00 00 4b 44 00 16 6d 40 15 b4 00 61 01 fa 50 3c 18 b0 "
    "0d 0a";
/// The first after power-on.
inline constexpr std::string_view kR4 =
    "93 78 00 00 78 00 00 88 00 00 ff 00 b5 d8 ff 87 17 00 36 7e ef 7f ff ff 4f 1f f6 80 00 00 ff 01 01 fa 2f 7d 41 27 "
    "0d 0a";
/// The last with the start-up bit, and the one after it.
inline constexpr std::string_view kR5 =
    "93 00 13 be fb 67 62 fd 90 dc 40 01 73 e1 00 26 fd 03 a9 c4 40 18 4e d1 02 41 fb 3a c2 54 40 32 01 fa 26 23 33 8c "
    "0d 0a";
inline constexpr std::string_view kR6 =
    "93 00 12 04 fb 71 59 fd 8e b3 00 01 75 25 00 22 1f 03 a7 d8 00 18 4f 4d 02 49 89 3a c6 b0 00 33 03 f4 92 fd e7 10 "
    "0d 0a";
/// R1 with two bytes altered.
inline constexpr std::string_view kR7Bad =
    "93 ff fb db 00 00 7c ff fc c5 00 00 05 ce 00 01 f6 04 0e 54 00 00 53 98 ff b2 b7 40 2d 99 00 41 01 fb 60 73 e3 de "
    "0d 0a";
inline constexpr std::string_view kA =
    "91 00 40 00 ff e0 00 00 00 01 00 00 00 00 f8 00 00 04 00 00 00 08 01 fa 73 2b c1 ae";
inline constexpr std::string_view kABad =
    "91 00 40 01 ff e0 00 00 00 01 00 00 00 00 f8 00 00 04 00 00 00 08 01 fa 73 2b c1 ae";
/// Increments, CR LF, overload of accelerometer Z.
inline constexpr std::string_view kB =
    "91 20 00 00 e0 00 00 00 02 0c 00 40 00 00 ff 5f 60 7f ff ff 14 10 01 fb 1e e2 9a 9a 0d 0a";
/// With temperatures, starting, gyros at the ends of their numbers.
inline constexpr std::string_view kC =
    "a5 80 00 00 7f ff ff 00 00 00 40 10 00 00 f0 00 00 08 00 00 40 19 00 d8 00 00 80 40 19 00 19 01 ff ff 40 ff 03 f5 "
    "6a e9 86 b4";
/// Everything.
inline constexpr std::string_view kD =
    "f7 00 00 64 00 00 c8 00 01 2c 00 00 03 e8 00 07 d0 08 00 00 00 00 00 0a 00 00 14 40 00 00 00 23 a0 23 c0 23 a0 00 "
    "23 19 23 0a 23 1c 00 23 95 23 b6 23 95 00 01 e2 40 00 e1 01 fa a9 69 69 fd";
/// Configuration: 250 Hz, rate and acceleration, 921600 bit/s, gyro rate delayed, filters 262 Hz, 10 g.
inline constexpr std::string_view kE = "bc 4b 00 22 21 78 44 40 70 44 40 70 44 42 0c 00 00 00 00 00 00 00 2d ea 68 23";
/// Serial number N25582405002002.
inline constexpr std::string_view kF = "b5 4e 25 58 24 05 00 20 02 00 00 00 00 00 00 00 2d 58 73 1d";

}  // namespace plumb::test
