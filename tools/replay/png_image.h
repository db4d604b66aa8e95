#pragma once
// An image file of a recording.

#include <cstdint>
#include <filesystem>
#include <vector>

#include "fsw/measurement/samples.h"

namespace plumb::replay {

/// Grey levels of a PNG file, which stay until the next one is read.
class PngImage {
 public:
  /// Throws InputError, which names the file, unless it is a whole PNG of 8 bits per pixel and channel. Colour becomes
  /// luminance.
  ImageView read(const std::filesystem::path& file);

 private:
  std::vector<std::uint8_t> pixels_;
};

}  // namespace plumb::replay
