#pragma once
// How far the replay is, in images.

#include <chrono>
#include <cstddef>

#include "tools/replay/flight.h"
#include "tools/replay/progress_bar.h"

namespace plumb::replay {

class Progress final : public FlightListener {
 public:
  explicit Progress(std::size_t images);

  void on_image(const ImageRecord& record) override;

 private:
  std::size_t images_;
  std::size_t done_ = 0;
  ProgressBar bar_;
  std::chrono::steady_clock::time_point started_;
};

}  // namespace plumb::replay
