// Any message on the camera socket, and any buffer of a bridge: what is taken for an image has all of its pixels within
// what came, and says nothing that cannot be. Input: the message; of the buffer, the first byte is the format.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hal/linux/frame_message.h"
#include "hal/linux/grey_image.h"

namespace {

using namespace plumb;

// Reads every pixel, so that the sanitizer sees one that is not there.
void look_at(const ImageView& image) {
  PLUMB_ASSERT(image.width > 0 && image.height > 0 && image.stride >= image.width);
  unsigned sum = 0;
  for (std::int32_t v = 0; v < image.height; ++v) {
    const std::uint8_t* const row = image.pixels + static_cast<std::ptrdiff_t>(v) * image.stride;
    for (std::int32_t u = 0; u < image.width; ++u) sum += row[u];
  }
  volatile unsigned used = sum;
  (void)used;
}

void take_message(std::span<const std::uint8_t> message) {
  const Result<FrameMessageKind> kind = kind_of(message);
  if (!kind) return;
  const auto is_exposure = [](const Exposure& exposure) { return exposure.time > Duration() && exposure.gain > 0.0; };
  switch (*kind) {
    case FrameMessageKind::kFrame:
      if (const Result<PortFrame> frame = decode_frame(message)) {
        look_at(frame->image);
        PLUMB_ASSERT(!frame->has_exposure || is_exposure(frame->exposure));
      }
      break;
    case FrameMessageKind::kMode:
      if (const Result<CameraAbilities> abilities = decode_abilities(message)) {
        PLUMB_ASSERT(is_exposure(abilities->least) && abilities->least.time <= abilities->most.time);
      }
      break;
    case FrameMessageKind::kStart:
      if (const Result<CameraMode> mode = decode_start(message)) PLUMB_ASSERT(mode->period > Duration());
      break;
    case FrameMessageKind::kExpose:
      if (const Result<Exposure> exposure = decode_exposure(message)) PLUMB_ASSERT(is_exposure(*exposure));
      break;
    case FrameMessageKind::kStop: break;
  }
}

void take_buffer(std::span<const std::uint8_t> data) {
  constexpr std::size_t kHeader = 4;
  if (data.size() < kHeader) return;
  const auto width = static_cast<std::int32_t>(data[1]) - 1;  // none, and fewer, too
  const auto height = static_cast<std::int32_t>(data[2]) - 1;
  const auto format = static_cast<GreyFormat>(data[0] % 3);
  std::vector<std::uint8_t> unpacked;
  const Result<ImageView> image =
      to_grey({.format = format, .width = width, .height = height, .stride = data[3], .bytes = data.subspan(kHeader)},
              unpacked);
  if (image) look_at(*image);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  take_message({data, size});
  take_buffer({data, size});
  return 0;
}
