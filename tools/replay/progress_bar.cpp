#include "tools/replay/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace plumb {
namespace {
constexpr std::chrono::milliseconds kRedraw{100};
constexpr int kBarWidth = 40;  // characters
}  // namespace

ProgressBar::ProgressBar() : terminal_(isatty(STDERR_FILENO) == 1), t_drawn_(std::chrono::steady_clock::now()) {}

ProgressBar::~ProgressBar() {
  if (drawn_) std::fputc('\n', stderr);  // whatever comes next starts on its own line
}

void ProgressBar::show(double fraction, const std::string& text) {
  fraction = std::clamp(fraction, 0.0, 1.0);
  if (terminal_) {
    const auto now = std::chrono::steady_clock::now();
    if (now - t_drawn_ < kRedraw && fraction < 1.0) return;
    t_drawn_ = now;
    drawn_ = true;
    draw(fraction, text);
    return;
  }
  const int tenths = static_cast<int>(10.0 * fraction);
  if (tenths == tenths_told_) return;
  tenths_told_ = tenths;
  std::fprintf(stderr, "%3d %%  %s\n", 10 * tenths, text.c_str());
}

void ProgressBar::draw(double fraction, const std::string& text) const {
  const auto filled = static_cast<std::size_t>(kBarWidth * fraction);
  const std::string bar = std::string(filled, '#') + std::string(kBarWidth - filled, '.');
  std::fprintf(stderr, "\r[%s] %3.0f %%  %s ", bar.c_str(), 100.0 * fraction, text.c_str());
  std::fflush(stderr);
}

}  // namespace plumb
