#pragma once
// How far something is, on stderr: a bar on a terminal, otherwise a line per tenth.

#include <chrono>
#include <string>

namespace plumb {

class ProgressBar {
 public:
  ProgressBar();
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// `fraction`: 0 to 1. `text`: what stands behind it.
  void show(double fraction, const std::string& text);

 private:
  void draw(double fraction, const std::string& text) const;

  bool terminal_;
  bool drawn_ = false;
  int tenths_told_ = 0;
  std::chrono::steady_clock::time_point t_drawn_;
};

}  // namespace plumb
