#include "tools/replay/raw_samples.h"

#include <algorithm>

#include "fsw/telemetry/raw_messages.h"

namespace plumb::replay {
namespace {

// Both are in the order in which the driver made them. The stamp finds the sample; whether the rest is the same, the
// hashes tell.
template <class Sample, class Samples>
std::string replace(const char* name, std::deque<Sample>& made, Samples& recorded) {
  for (Sample& sample : recorded) {
    while (!made.empty() && made.front().t != sample.t) made.pop_front();
    if (made.empty()) {
      return std::string("--raw: the ") + name + " sample at " + std::to_string(sample.t.ns()) +
             " ns does not come of the recorded bytes";
    }
    sample = made.front();
    made.pop_front();
  }
  return {};
}

}  // namespace

RawSamples::RawSamples(const FlightSetup& setup)
    : stim300_(setup.imu.settings), capture_(setup.range.lidar_lite.model), can_(setup.range.can) {}

bool RawSamples::take(std::string_view channel, MessageBytes message) {
  if (channel == channel::kRawStim300) return take_serial(message);
  if (channel == channel::kRawLidarLite) return take_transfer(message);
  if (channel == channel::kRawCan) return take_can_frame(message);
  return true;
}

bool RawSamples::take_serial(MessageBytes message) {
  RawBytes raw;
  if (!ok(decode(message, raw)) || raw.bytes.size() > stim300::kMaxChunkBytes) return false;
  stim300::Samples samples;
  stim300_.feed({raw.bytes.data(), raw.bytes.size()}, raw.t, samples);
  imu_.insert(imu_.end(), samples.begin(), samples.end());
  return true;
}

bool RawSamples::take_transfer(MessageBytes message) {
  RawTransfer raw;
  if (!ok(decode(message, raw))) return false;
  lidar_lite::Transfer transfer{
      .t_stop = raw.t_stop, .is_read = raw.is_read, .acknowledged = raw.acknowledged, .bytes = {}};
  for (const std::uint8_t byte : raw.bytes) static_cast<void>(transfer.bytes.push_back(byte));  // the same capacity
  const Result<lidar_lite::Measurement> measured = capture_.decode(transfer);
  if (measured && measured->interpreted.verdict != lidar_lite::Verdict::kNoReading) {
    range_.push_back(lidar_lite::to_sample(measured->interpreted, measured->t));
  }
  return true;
}

bool RawSamples::take_can_frame(MessageBytes message) {
  RawCanFrame raw;
  if (!ok(decode(message, raw))) return false;
  ReceivedCanFrame received{.t = raw.t, .frame = {.id = raw.id, .is_extended = raw.is_extended}};
  received.frame.size = static_cast<std::uint8_t>(raw.bytes.size());
  std::copy(raw.bytes.begin(), raw.bytes.end(), received.frame.bytes.begin());
  if (const Result<can_range::Reading> reading = can_.decode(received)) range_.push_back(reading->sample);
  return true;
}

std::string RawSamples::replace_samples(InputFrame& input) {
  const std::string fault = replace("IMU", imu_, input.imu);
  return fault.empty() ? replace("range", range_, input.range) : fault;
}

}  // namespace plumb::replay
