#pragma once
// How far the replay is, on stderr: a bar on a terminal, otherwise a line per tenth.

#include <chrono>
#include <cstddef>

#include "tools/replay/flight.h"

namespace plumb::replay {

class Progress final : public FlightListener {
 public:
  explicit Progress(std::size_t images);
  ~Progress() override;
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void on_image(const ImageRecord& record) override;

 private:
  void draw(double fraction, double images_per_s);

  std::size_t images_;
  std::size_t done_ = 0;
  bool terminal_;
  int tenths_told_ = 0;
  std::chrono::steady_clock::time_point started_;
  std::chrono::steady_clock::time_point drawn_;
};

}  // namespace plumb::replay
