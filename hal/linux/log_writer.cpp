#include "hal/linux/log_writer.h"

#include <array>

#include "fsw/telemetry/executive_messages.h"

namespace plumb {

LogWriter::LogWriter(LogSink& file, std::vector<QueuedLog*> first, QueuedLog& last)
    : file_(file), room_(kMaxRecordBytes) {
  for (QueuedLog* log : first) queues_.push_back({.log = log});
  queues_.push_back({.log = &last});
}

void LogWriter::drain(Time now) {
  queues_.back().end = queues_.back().log->ring().written();
  for (Queue& queue : queues_) {
    if (&queue != &queues_.back()) queue.end = queue.log->ring().written();
  }
  for (Queue& queue : queues_) write_until_end(queue, now);
}

void LogWriter::write_until_end(Queue& queue, Time now) {
  RecordRing::Record record;
  while (queue.log->ring().pop(queue.end, room_, record)) write(record.channel, record.t, record.bytes);
  const std::uint64_t dropped = queue.log->ring().dropped();
  if (dropped == queue.told) return;
  std::array<std::uint8_t, kMaxMessageBytes> message{};
  const Result<std::size_t> size =
      encode(LogGap{.t = now, .queue = queue.log->name(), .records = dropped - queue.told}, message);
  queue.told = dropped;
  write(channel::kLogGap, now, MessageBytes(message.data(), size.value()));
}

void LogWriter::write(const char* channel, Time t, std::span<const std::uint8_t> bytes) {
  ++(ok(file_.write(channel, t, bytes)) ? written_ : refused_);
}

std::uint64_t LogWriter::dropped() const {
  std::uint64_t dropped = 0;
  for (const Queue& queue : queues_) dropped += queue.log->ring().dropped();
  return dropped;
}

}  // namespace plumb
