#include "tools/replay/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace plumb::replay {
namespace {
constexpr std::chrono::milliseconds kRedraw{100};
constexpr int kBarWidth = 40;  // characters
}  // namespace

Progress::Progress(std::size_t images)
    : images_(std::max<std::size_t>(images, 1)),
      terminal_(isatty(STDERR_FILENO) == 1),
      started_(std::chrono::steady_clock::now()),
      drawn_(started_) {}

Progress::~Progress() {
  if (terminal_ && done_ > 0) std::fputc('\n', stderr);  // whatever comes next starts on its own line
}

void Progress::on_image(const ImageRecord&) {
  ++done_;
  const auto now = std::chrono::steady_clock::now();
  const double elapsed_s = std::chrono::duration<double>(now - started_).count();
  const double images_per_s = elapsed_s > 0.0 ? static_cast<double>(done_) / elapsed_s : 0.0;
  const double fraction = std::min(1.0, static_cast<double>(done_) / static_cast<double>(images_));
  if (terminal_) {
    if (now - drawn_ < kRedraw && done_ < images_) return;
    drawn_ = now;
    draw(fraction, images_per_s);
    return;
  }
  const int tenths = static_cast<int>(10.0 * fraction);
  if (tenths == tenths_told_) return;
  tenths_told_ = tenths;
  std::fprintf(stderr, "%3d %%  image %zu of %zu, %.0f per second\n", 10 * tenths, done_, images_, images_per_s);
}

void Progress::draw(double fraction, double images_per_s) {
  const int filled = static_cast<int>(kBarWidth * fraction);
  const std::string bar = std::string(static_cast<std::size_t>(filled), '#') +
                          std::string(static_cast<std::size_t>(kBarWidth - filled), '.');
  std::fprintf(stderr, "\r[%s] %3.0f %%  image %zu of %zu, %.0f per second ", bar.c_str(), 100.0 * fraction, done_,
               images_, images_per_s);
  std::fflush(stderr);
}

}  // namespace plumb::replay
