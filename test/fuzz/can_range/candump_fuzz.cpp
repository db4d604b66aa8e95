// Any text as a line of candump: what comes out is a frame that exists.

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "drivers/can_range/candump.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plumb;
  const auto parsed = can_range::parse_candump_line({reinterpret_cast<const char*>(data), size});
  if (parsed) {
    PLUMB_ASSERT(parsed->frame.size <= kCanMaxDataBytes);
    PLUMB_ASSERT(parsed->frame.id <= (parsed->frame.is_extended ? kCanExtendedIdMask : kCanStandardIdMask));
  }
  return 0;
}
