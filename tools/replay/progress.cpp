#include "tools/replay/progress.h"

#include <algorithm>
#include <cstdio>

namespace plumb::replay {

Progress::Progress(std::size_t images)
    : images_(std::max<std::size_t>(images, 1)), started_(std::chrono::steady_clock::now()) {}

void Progress::on_image(const ImageRecord&) {
  ++done_;
  const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
  const double images_per_s = elapsed_s > 0.0 ? static_cast<double>(done_) / elapsed_s : 0.0;
  char text[80];
  std::snprintf(text, sizeof text, "image %zu of %zu, %.0f per second", done_, images_, images_per_s);
  bar_.show(static_cast<double>(done_) / static_cast<double>(images_), text);
}

}  // namespace plumb::replay
