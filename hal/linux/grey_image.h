#pragma once
// The pixel formats that a grey sensor's bridge delivers, as 8 bits a pixel.
// Source: Linux, Documentation/userspace-api/media/v4l/pixfmt-yuv-luma.rst.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fsw/base/status.h"
#include "fsw/measurement/samples.h"

namespace plumb {

enum class GreyFormat : std::uint8_t {
  kGrey = 0,   ///< 'GREY': 8 bits in a byte
  kY10,        ///< 'Y10 ': 10 bits in two bytes, low byte first
  kY10Packed,  ///< 'Y10P': the upper 8 bits of four pixels in a byte each, then their lower 2 bits in a fifth
};

/// An image as it lies in a buffer. Nothing about it need be true.
struct RawImage {
  GreyFormat format = GreyFormat::kGrey;
  std::int32_t width = 0;   ///< px
  std::int32_t height = 0;  ///< px
  std::int64_t stride = 0;  ///< bytes from row to row
  std::span<const std::uint8_t> bytes;
};

/// Bytes that the pixels of a row take.
std::int64_t row_bytes(GreyFormat format, std::int32_t width);

/// The image with 8 bits a pixel, the lower two of ten dropped. Where it is that already, the view is of its own bytes;
/// else of `unpacked`, which grows to the size needed and never shrinks. kInvalidValue: no pixels, rows that overlap,
/// or fewer bytes than the rows take.
Result<ImageView> to_grey(const RawImage& raw, std::vector<std::uint8_t>& unpacked);

}  // namespace plumb
