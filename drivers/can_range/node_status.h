#pragma once
// Plumb as a node on a DroneCAN bus: uavcan.protocol.NodeStatus once a second, from which other nodes know that it is
// there and how it does. Without it for 3 s they take it for offline.
//
// Source: public_regulated_data_types b4653c7, uavcan/protocol/341.NodeStatus.

#include <cstdint>

#include "fsw/base/status.h"
#include "fsw/base/time.h"
#include "hal/include/can_socket.h"

namespace plumb::can_range {

inline constexpr std::uint32_t kNodeStatusTypeId = 341;
inline constexpr Duration kNodeStatusPeriod = Duration::from_ms(1000);

enum class NodeHealth : std::uint8_t { kOk = 0, kWarning, kError, kCritical };
enum class NodeMode : std::uint8_t { kOperational = 0, kInitialization, kMaintenance, kSoftwareUpdate, kOffline = 7 };

struct NodeStatusOptions {
  /// 1 to 127, of nobody else on the bus. The first are autopilots', 126 and 127 those of maintenance tools, and nodes
  /// without one of their own are given them from 125 downwards.
  std::uint8_t node_id = 20;
  std::uint8_t priority = 16;  ///< 0, the highest, to 31
  std::uint16_t vendor_code = 0;
};

class NodeStatusBroadcast {
 public:
  /// Uptime counts from `start`. Precondition: options within their limits.
  NodeStatusBroadcast(const NodeStatusOptions& options, Time start);

  /// The frame that is due at `now`, once a second; kNotReady in between. What was missed is not made up for.
  Result<CanFrame> next(Time now, NodeHealth health, NodeMode mode);

 private:
  NodeStatusOptions options_;
  Time start_;
  Time due_;
  std::uint8_t transfer_id_ = 0;
};

}  // namespace plumb::can_range
