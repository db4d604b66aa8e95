#include "drivers/can_range/node_status.h"

#include <algorithm>

#include "drivers/can_range/dronecan.h"

namespace plumb::can_range {

NodeStatusBroadcast::NodeStatusBroadcast(const NodeStatusOptions& options, Time start)
    : options_(options), start_(start), due_(start) {
  PLUMB_ASSERT(options.node_id >= 1 && options.node_id <= kMaxNodeId);
  PLUMB_ASSERT(options.priority <= 31);
}

Result<CanFrame> NodeStatusBroadcast::next(Time now, NodeHealth health, NodeMode mode) {
  if (now < due_) return Status::kNotReady;
  // Keeps the rhythm through small delays, and starts a new one after a long one.
  due_ = std::max(due_ + kNodeStatusPeriod, now + kNodeStatusPeriod / 2);
  const auto uptime_s = static_cast<std::uint32_t>(std::max<std::int64_t>((now - start_).ns() / kNsPerSecond, 0));
  CanFrame frame;
  frame.id = static_cast<std::uint32_t>(options_.priority) << kPriorityShift | kNodeStatusTypeId << kTypeIdShift |
             options_.node_id;
  frame.is_extended = true;
  frame.size = kCanMaxDataBytes;
  for (std::size_t i = 0; i < 4; ++i) frame.bytes[i] = static_cast<std::uint8_t>(uptime_s >> (8 * i));
  frame.bytes[4] = static_cast<std::uint8_t>(static_cast<unsigned>(health) << 6U | static_cast<unsigned>(mode) << 3U);
  frame.bytes[5] = static_cast<std::uint8_t>(options_.vendor_code);
  frame.bytes[6] = static_cast<std::uint8_t>(options_.vendor_code >> 8U);
  frame.bytes[7] = kTailStart | kTailEnd | transfer_id_;
  transfer_id_ = (transfer_id_ + 1U) & kTailTransferId;
  return frame;
}

}  // namespace plumb::can_range
