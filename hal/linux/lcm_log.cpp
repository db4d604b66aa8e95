#include "hal/linux/lcm_log.h"

#include <lcm/lcm.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

namespace plumb {
namespace {

// Sync word, number, time, lengths of channel and data.
constexpr std::int64_t kEventHeaderBytes = 4 + 8 + 8 + 4 + 4;

}  // namespace
namespace {

lcm_eventlog_t* open_log(const std::string& file, const char* mode, std::string& error) {
  errno = 0;
  lcm_eventlog_t* log = lcm_eventlog_create(file.c_str(), mode);
  if (log == nullptr) error = file + ": cannot be opened: " + std::strerror(errno);
  return log;
}

}  // namespace

std::unique_ptr<LcmLogWriter> LcmLogWriter::open(const std::string& file, std::string& error) {
  lcm_eventlog_t* log = open_log(file, "w", error);
  return log == nullptr ? nullptr : std::unique_ptr<LcmLogWriter>(new LcmLogWriter(log));
}

LcmLogWriter::~LcmLogWriter() { lcm_eventlog_destroy(log_); }

Status LcmLogWriter::write(const char* channel, Time t, std::span<const std::uint8_t> message) {
  // A record that went in by half would hide what follows it. So what is in the file ends with the first that failed.
  if (std::ferror(log_->f) != 0) return Status::kRejected;
  // LCM's record holds pointers to non-const; writing only reads through them.
  lcm_eventlog_event_t event{};
  event.timestamp = t.ns() / 1000;
  event.channellen = static_cast<std::int32_t>(std::strlen(channel));
  event.datalen = static_cast<std::int32_t>(message.size());
  event.channel = const_cast<char*>(channel);
  event.data = const_cast<std::uint8_t*>(message.data());
  return lcm_eventlog_write_event(log_, &event) == 0 ? Status::kOk : failed();
}

Status LcmLogWriter::flush() { return std::fflush(log_->f) == 0 && std::ferror(log_->f) == 0 ? Status::kOk : failed(); }

Status LcmLogWriter::failed() {
  if (last_error_ == 0) last_error_ = errno;
  return Status::kRejected;
}

std::unique_ptr<LcmLogReader> LcmLogReader::open(const std::string& file, std::string& error) {
  std::error_code unreadable;  // opening tells
  if (std::filesystem::is_directory(file, unreadable)) {
    error = file + ": is a folder; expected an LCM event log";
    return nullptr;
  }
  lcm_eventlog_t* log = open_log(file, "r", error);
  return log == nullptr ? nullptr : std::unique_ptr<LcmLogReader>(new LcmLogReader(log));
}

LcmLogReader::LcmLogReader(lcm_eventlog_t* log) : log_(log) {
  std::fseek(log_->f, 0, SEEK_END);
  size_ = std::ftell(log_->f);
  std::fseek(log_->f, 0, SEEK_SET);
}

LcmLogReader::~LcmLogReader() {
  if (event_ != nullptr) lcm_eventlog_free_event(event_);
  lcm_eventlog_destroy(log_);
}

// Whether what follows is an event that would end behind the file.
bool LcmLogReader::is_piece_left() const {
  const std::int64_t left = size_ - position_;
  if (left < kEventHeaderBytes) return left > 0;
  std::array<std::uint8_t, kEventHeaderBytes> header{};
  if (pread(fileno(log_->f), header.data(), header.size(), position_) != kEventHeaderBytes) return false;
  const auto number_at = [&header](std::size_t at) {  // big-endian
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < 4; ++i) number = number << 8U | header[at + i];
    return number;
  };
  constexpr std::uint32_t kSync = 0xEDA1DA01;
  return number_at(0) == kSync && kEventHeaderBytes + std::int64_t{number_at(20)} + number_at(24) > left;
}

Status LcmLogReader::next(LogEvent& event) {
  if (event_ != nullptr) lcm_eventlog_free_event(event_);
  event_ = lcm_eventlog_read_next_event(log_);
  if (event_ == nullptr) {
    is_cut_ = is_piece_left();
    return is_cut_ || position_ == size_ ? Status::kNotReady : Status::kInvalidValue;
  }
  // LCM looks for the next sync word on its own: bytes passed over mean that something is damaged.
  position_ += kEventHeaderBytes + event_->channellen + event_->datalen;
  if (std::ftell(log_->f) != position_) return Status::kInvalidValue;
  event.channel.assign(event_->channel, static_cast<std::size_t>(event_->channellen));
  event.t = Time::from_ns(detail::saturating_mul(event_->timestamp, 1000));
  event.message = {static_cast<const std::uint8_t*>(event_->data), static_cast<std::size_t>(event_->datalen)};
  return Status::kOk;
}

}  // namespace plumb
