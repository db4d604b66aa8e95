#include "fsw/base/status.h"

namespace plumb {

const char* to_string(Status status) {
  switch (status) {
    case Status::kOk: return "ok";
    case Status::kNotReady: return "not ready";
    case Status::kInvalidValue: return "invalid value";
    case Status::kOutOfOrder: return "out of order";
    case Status::kStale: return "stale";
    case Status::kFull: return "full";
    case Status::kRejected: return "rejected";
    case Status::kIllConditioned: return "ill-conditioned";
    case Status::kNumericalFault: return "numerical fault";
  }
  return "unknown";
}

}  // namespace plumb
