// libFuzzer on the bytes of a log, read as input frames and from the bytes of the devices. The log is refused with a
// message, or every tick of it comes.

#include <cstddef>
#include <cstdint>
#include <string>

#include "test/fuzz/recording/read_all.h"
#include "test/support/temporary_folder.h"
#include "tools/replay/log_reader.h"

namespace plumb::replay {
namespace {

void check_log(const std::filesystem::path& file, bool from_raw) {
  read_all([&] { return open_log({.file = file, .parameters = {}, .use_range = true, .from_raw = from_raw}); },
           [](const Tick& tick) {
             if (tick.input.has_camera)
               PLUMB_ASSERT(tick.image.pixels != nullptr && tick.image.stride >= tick.image.width);
           });
}

}  // namespace
}  // namespace plumb::replay

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const plumb::test::TemporaryFolder folder;
  const auto file = folder.write("flight.lcm", std::string(reinterpret_cast<const char*>(data), size));
  plumb::replay::check_log(file, false);
  plumb::replay::check_log(file, true);
  return 0;
}
