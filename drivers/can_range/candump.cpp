#include "drivers/can_range/candump.h"

#include <algorithm>
#include <cstdint>
#include <optional>

namespace plumb::can_range {
namespace {

constexpr std::string_view kBlank = " \t\r\n";
constexpr std::uint32_t kErrorFlag = 0x2000'0000;  // CAN_ERR_FLAG of linux/can.h, which candump prints

std::optional<std::uint64_t> number(std::string_view text, unsigned base) {
  constexpr std::size_t kMaxDigits = 16;
  if (text.empty() || text.size() > kMaxDigits) return std::nullopt;
  std::uint64_t value = 0;
  for (const char c : text) {
    unsigned digit = base;
    if (c >= '0' && c <= '9') digit = static_cast<unsigned>(c - '0');
    if (c >= 'A' && c <= 'F') digit = static_cast<unsigned>(c - 'A') + 10;
    if (c >= 'a' && c <= 'f') digit = static_cast<unsigned>(c - 'a') + 10;
    if (digit >= base) return std::nullopt;
    value = value * base + digit;
  }
  return value;
}

// substr() without its exception. Precondition: from <= text.size().
std::string_view part(std::string_view text, std::size_t from, std::size_t size = std::string_view::npos) {
  PLUMB_ASSERT(from <= text.size());
  return {text.data() + from, std::min(size, text.size() - from)};
}

// Takes the next word off the line.
std::string_view take_word(std::string_view& line) {
  const std::size_t begin = line.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return line = {};
  line.remove_prefix(begin);
  const std::string_view word = part(line, 0, line.find_first_of(kBlank));
  line.remove_prefix(word.size());
  return word;
}

// (seconds.microseconds)
std::optional<Time> stamp(std::string_view word) {
  constexpr std::size_t kMicrosecondDigits = 6;
  constexpr std::size_t kMaxSecondDigits = 10;
  const std::size_t point = word.find('.');
  if (word.size() < 4 || word.front() != '(' || word.back() != ')' || point == std::string_view::npos)
    return std::nullopt;
  const std::string_view fraction = part(word, point + 1, word.size() - point - 2);
  if (fraction.size() != kMicrosecondDigits || point - 1 > kMaxSecondDigits) return std::nullopt;
  const std::optional<std::uint64_t> seconds = number(part(word, 1, point - 1), 10);
  const std::optional<std::uint64_t> us = number(fraction, 10);
  if (!seconds || !us) return std::nullopt;
  return Time::from_ns(0) + Duration::from_ms(1000) * static_cast<std::int64_t>(*seconds) +
         Duration::from_us(static_cast<std::int64_t>(*us));
}

}  // namespace

Result<ReceivedCanFrame> parse_candump_line(std::string_view line) {
  const std::string_view first = take_word(line);
  if (first.empty()) return Status::kNotReady;
  const std::optional<Time> t = stamp(first);
  const std::string_view interface_name = take_word(line);
  const std::string_view text = take_word(line);
  const std::size_t hash = text.find('#');
  if (!t || interface_name.empty() || hash == std::string_view::npos) return Status::kInvalidValue;

  const std::optional<std::uint64_t> id = number(part(text, 0, hash), 16);
  std::string_view data = part(text, hash + 1);
  if (!id || (hash != 3 && hash != 8)) return Status::kInvalidValue;
  const bool other_kind = (*id & kErrorFlag) != 0 || (!data.empty() && (data[0] == '#' || data[0] == 'R'));
  if (other_kind) return Status::kNotReady;
  ReceivedCanFrame received{.t = *t, .frame = {}};
  received.frame.id = static_cast<std::uint32_t>(*id);
  received.frame.is_extended = hash == 8;
  if (received.frame.id > (received.frame.is_extended ? kCanExtendedIdMask : kCanStandardIdMask)) {
    return Status::kInvalidValue;
  }
  if (data.size() % 2 != 0 || data.size() > 2 * kCanMaxDataBytes) return Status::kInvalidValue;
  received.frame.size = static_cast<std::uint8_t>(data.size() / 2);
  for (std::size_t i = 0; i < received.frame.size; ++i) {
    const std::optional<std::uint64_t> byte = number(part(data, 2 * i, 2), 16);
    if (!byte) return Status::kInvalidValue;
    received.frame.bytes[i] = static_cast<std::uint8_t>(*byte);
  }
  return received;
}

}  // namespace plumb::can_range
