#include "tools/decode/i2c_trace.h"

#include <cinttypes>
#include <cstdio>
#include <string_view>

namespace plumb::decode {

struct I2cTrace::Event {
  enum class Kind { kWrite, kRead, kReply, kResult };
  Kind kind = Kind::kResult;
  Time t;
  int bus = 0;
  int address = 0;
  int messages = 0;  ///< of the whole transfer
  int result = 0;    ///< messages that were acknowledged, or an error number below zero
  std::vector<std::uint8_t> bytes;
};

namespace {

constexpr std::string_view kEvent = ": i2c_";

// seconds.microseconds, the last word before the event's name.
std::optional<Time> stamp_before(const std::string& line, std::size_t end) {
  const std::size_t blank = line.rfind(' ', end);
  const std::string word = line.substr(blank == std::string::npos ? 0 : blank + 1, end - blank - 1);
  std::int64_t seconds = 0;
  std::int64_t us = 0;
  int taken = 0;
  constexpr std::int64_t kMaxSeconds = 1'000'000'000;
  if (std::sscanf(word.c_str(), "%10" SCNd64 ".%6" SCNd64 "%n", &seconds, &us, &taken) != 2) return std::nullopt;
  if (static_cast<std::size_t>(taken) != word.size() || seconds < 0 || seconds > kMaxSeconds || us < 0)
    return std::nullopt;
  return Time::from_ns(seconds * kNsPerSecond) + Duration::from_us(us);
}

// [01-f4]
std::optional<std::vector<std::uint8_t>> bytes_of(const std::string& text, std::size_t count) {
  std::vector<std::uint8_t> bytes;
  std::size_t at = text.find('[');
  for (std::size_t i = 0; i < count; ++i, at += 3) {
    unsigned value = 0;
    if (at == std::string::npos || at + 3 >= text.size()) return std::nullopt;
    if (std::sscanf(text.c_str() + at + 1, "%2x", &value) != 1) return std::nullopt;
    bytes.push_back(static_cast<std::uint8_t>(value));
  }
  return bytes;
}

}  // namespace

std::optional<I2cTrace::Event> I2cTrace::parse(const std::string& line, bool& names_an_event) {
  const std::size_t at = line.find(kEvent);
  names_an_event = at != std::string::npos && line.front() != '#';
  if (!names_an_event) return std::nullopt;
  const std::optional<Time> t = stamp_before(line, at);
  if (!t) return std::nullopt;
  Event event;
  event.t = *t;
  const std::string rest = line.substr(at + kEvent.size());
  if (std::sscanf(rest.c_str(), "result: i2c-%d n=%d ret=%d", &event.bus, &event.messages, &event.result) == 3)
    return event;
  char name[6]{};
  int number = 0;
  unsigned address = 0;
  unsigned flags = 0;
  unsigned size = 0;
  const int fields = std::sscanf(rest.c_str(), "%5[a-z]: i2c-%d #%d a=%x f=%x l=%u", name, &event.bus, &number,
                                 &address, &flags, &size);
  constexpr unsigned kMaxBytes = 4096;
  constexpr int kFields = 6;
  if (fields != kFields || size > kMaxBytes) return std::nullopt;
  event.address = static_cast<int>(address);
  const std::string_view kind = name;
  if (kind == "read") {
    event.kind = Event::Kind::kRead;
    return event;
  }
  if (kind != "write" && kind != "reply") return std::nullopt;
  event.kind = kind == "write" ? Event::Kind::kWrite : Event::Kind::kReply;
  const std::optional<std::vector<std::uint8_t>> bytes = bytes_of(rest, size);
  if (!bytes) return std::nullopt;
  event.bytes = *bytes;
  return event;
}

std::optional<I2cTransfer> I2cTrace::take(const std::string& line) {
  bool names_an_event = false;
  const std::optional<Event> event = parse(line, names_an_event);
  if (!event) {
    ++(names_an_event ? counters_.malformed_lines : counters_.other_lines);
    return std::nullopt;
  }
  if (event->kind == Event::Kind::kResult) return finish(*event);
  if (event->kind == Event::Kind::kReply) {
    if (event->bus == bus_ && event->address == address_) transfer_.bytes = event->bytes;
    return std::nullopt;
  }
  if (event->bus != bus_) messages_ = 0;
  bus_ = event->bus;
  ++messages_;
  of_device_ = event->address == address_;
  transfer_ = {
      .t_stop = {}, .is_read = event->kind == Event::Kind::kRead, .acknowledged = false, .bytes = event->bytes};
  return std::nullopt;
}

std::optional<I2cTransfer> I2cTrace::finish(const Event& result) {
  const bool begun = result.bus == bus_ && messages_ > 0;
  const bool single = begun && messages_ == 1 && of_device_;
  messages_ = 0;
  if (!begun) return std::nullopt;  // its beginning was not recorded
  if (!single) {
    ++counters_.others;
    return std::nullopt;
  }
  ++counters_.transfers;
  transfer_.t_stop = result.t;
  transfer_.acknowledged = result.result == 1;
  return transfer_;
}

}  // namespace plumb::decode
