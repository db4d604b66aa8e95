#include "tools/replay/png_image.h"

#include <png.h>

#include "config/input_error.h"

namespace plumb::replay {

ImageView PngImage::read(const std::filesystem::path& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0) {
    throw InputError(file.string() + ": not readable as an image: " + image.message);
  }
  if ((image.format & PNG_FORMAT_FLAG_LINEAR) != 0) {
    png_image_free(&image);
    throw InputError(file.string() + ": has more than 8 bits per pixel; expected 8");
  }
  image.format = PNG_FORMAT_GRAY;
  pixels_.assign(PNG_IMAGE_SIZE(image), 0);  // the black behind what is transparent
  if (png_image_finish_read(&image, nullptr, pixels_.data(), 0, nullptr) == 0) {
    throw InputError(file.string() + ": not readable as an image: " + image.message);
  }
  return {.pixels = pixels_.data(),
          .width = static_cast<std::int32_t>(image.width),
          .height = static_cast<std::int32_t>(image.height),
          .stride = static_cast<std::int32_t>(PNG_IMAGE_ROW_STRIDE(image))};
}

}  // namespace plumb::replay
