#include "hal/linux/grey_image.h"

namespace plumb {
namespace {

void unpack_y10(const std::uint8_t* from, std::int32_t width, std::uint8_t* to) {
  for (std::int32_t u = 0; u < width; ++u, from += 2)
    to[u] = static_cast<std::uint8_t>((from[0] >> 2) | (from[1] << 6));
}

void unpack_y10_packed(const std::uint8_t* from, std::int32_t width, std::uint8_t* to) {
  constexpr std::int32_t kGroup = 4;
  for (std::int32_t u = 0; u < width; ++u) to[u] = from[u + u / kGroup];
}

}  // namespace

std::int64_t row_bytes(GreyFormat format, std::int32_t width) {
  switch (format) {
    case GreyFormat::kGrey: return width;
    case GreyFormat::kY10: return 2 * std::int64_t{width};
    // Of the last group only as many bytes are read as there are pixels.
    case GreyFormat::kY10Packed: return std::int64_t{width} + (width - 1) / 4;
  }
  return 0;
}

Result<ImageView> to_grey(const RawImage& raw, std::vector<std::uint8_t>& unpacked) {
  if (raw.width <= 0 || raw.height <= 0) return Status::kInvalidValue;
  const std::int64_t row = row_bytes(raw.format, raw.width);
  constexpr std::int64_t kMaxStride = 1 << 20;  // so that no product below overflows
  if (raw.stride < row || raw.stride > kMaxStride) return Status::kInvalidValue;
  if (raw.stride * (raw.height - 1) + row > static_cast<std::int64_t>(raw.bytes.size())) return Status::kInvalidValue;
  if (raw.format == GreyFormat::kGrey) {
    return ImageView{raw.bytes.data(), raw.width, raw.height, static_cast<std::int32_t>(raw.stride)};
  }
  const auto width = static_cast<std::size_t>(raw.width);
  const std::size_t size = width * static_cast<std::size_t>(raw.height);
  if (unpacked.size() < size) unpacked.resize(size);
  const auto unpack = raw.format == GreyFormat::kY10 ? unpack_y10 : unpack_y10_packed;
  const std::uint8_t* from = raw.bytes.data();
  std::uint8_t* to = unpacked.data();
  for (std::int32_t v = 0; v < raw.height; ++v, from += raw.stride, to += width) unpack(from, raw.width, to);
  return ImageView{unpacked.data(), raw.width, raw.height, raw.width};
}

}  // namespace plumb
