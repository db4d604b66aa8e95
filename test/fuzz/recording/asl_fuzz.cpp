// libFuzzer on the files of a recording in the ASL layout. The first byte chooses the file that the rest takes the
// place of; the others stay as they are. The recording is refused with a message, or flown to its end.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "test/fuzz/recording/read_all.h"
#include "test/replay/small_recording.h"
#include "tools/replay/asl_reader.h"

namespace plumb::replay {
namespace {

const std::array<std::string, 8> kFiles = {"mav0/cam0/sensor.yaml",   "mav0/imu0/sensor.yaml",
                                           "mav0/range0/sensor.yaml", "mav0/cam0/data.csv",
                                           "mav0/imu0/data.csv",      "mav0/range0/data.csv",
                                           "parameters.yaml",         "mav0/state_groundtruth_estimate0/data.csv"};

void check_recording(const std::filesystem::path& folder) {
  Time t_last = Time::never();
  read_all([&] { return open_asl({.folder = folder, .parameters = folder / "parameters.yaml"}); },
           [&](const Tick& tick) {
             PLUMB_ASSERT(tick.input.t > t_last);
             t_last = tick.input.t;
           });
}

}  // namespace
}  // namespace plumb::replay

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plumb::replay;
  static const plumb::test::SmallRecording recording;
  static const bool with_parameters = !recording.write("parameters.yaml", "vision.pixel_noise: 1\n").empty();
  if (size == 0 || !with_parameters) return 0;
  const std::string& file = kFiles[data[0] % kFiles.size()];
  const std::string was = recording.content(file);
  recording.write(file, std::string(reinterpret_cast<const char*>(data) + 1, size - 1));
  check_recording(recording.path());
  recording.write(file, was);
  return 0;
}
