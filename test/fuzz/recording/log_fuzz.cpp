// libFuzzer on the bytes of a log, read as input frames and from the bytes of the devices. The log is refused with a
// message, or every tick of it comes.

#include <cstddef>
#include <cstdint>
#include <string>

#include "config/input_error.h"
#include "fsw/base/assert.h"
#include "test/support/temporary_folder.h"
#include "tools/replay/log_reader.h"

namespace plumb::replay {
namespace {

void read_all(const std::filesystem::path& file, bool from_raw) {
  try {
    const auto source = open_log({.file = file, .parameters = {}, .use_range = true, .from_raw = from_raw});
    Tick tick;
    while (source->next(tick)) {
      if (tick.input.has_camera) PLUMB_ASSERT(tick.image.pixels != nullptr && tick.image.stride >= tick.image.width);
    }
  } catch (const InputError& error) {
    PLUMB_ASSERT(error.what()[0] != '\0');
  }
}

}  // namespace
}  // namespace plumb::replay

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const plumb::test::TemporaryFolder folder;
  const auto file = folder.write("flight.lcm", std::string(reinterpret_cast<const char*>(data), size));
  plumb::replay::read_all(file, false);
  plumb::replay::read_all(file, true);
  return 0;
}
