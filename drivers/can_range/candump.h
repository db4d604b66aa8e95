#pragma once
// One line of the text that can-utils' `candump -L` (or -l) writes: (1436509052.249713) can0 10041A2A#0F8B000000000080

#include <string_view>

#include "fsw/base/status.h"
#include "hal/include/can_socket.h"

namespace plumb::can_range {

/// The data frame of a line, with or without the line's end. Eight digits make an extended identifier, three a standard
/// one. kNotReady: an empty line, or a frame of another kind (remote, error, CAN FD). kInvalidValue: not such a line.
Result<ReceivedCanFrame> parse_candump_line(std::string_view line);

}  // namespace plumb::can_range
