#pragma once
// What the implementations of CameraPort do alike: judge a frame's stamp, count what is missing, refuse exposures.

#include <cmath>
#include <cstddef>

#include "hal/include/camera_port.h"

namespace plumb {

inline bool can_be_asked_for(const Exposure& exposure) {
  return exposure.time > Duration() && exposure.gain > 0.0 && std::isfinite(exposure.gain);
}

class FrameStream {
 public:
  /// A frame does not wait longer than this between its end and receive(). A stamp beyond it, or in the future, is by
  /// another clock.
  static constexpr Duration kOldestStamp = Duration::from_ms(2000);

  /// The next frame is the first of a stream: none can be missing before it.
  void start() { is_first_ = true; }
  /// The stream is back after the camera was gone.
  void restart() {
    start();
    ++health_.restarts;
  }
  void on_exposure_lost(int error) { health_.exposures_lost.add(error); }
  /// `told`: by an image of another size, of whose pixels nothing is looked at.
  void on_malformed(std::size_t bytes, const ImageView& told = {}) {
    const bool tells = told.width != 0 || told.height != 0;
    health_.malformed.add(tells ? value_pair(told.width, told.height) : static_cast<std::int64_t>(bytes));
  }
  /// Counts the frame, taken at `now`. `on_flight_clock`: the source says that `frame.t` is by the flight clock; where
  /// that cannot be, `now` takes its place.
  void on_frame(PortFrame& frame, bool on_flight_clock, Time now) {
    if (!on_flight_clock || frame.t > now || frame.t < now - kOldestStamp) {
      health_.stamps_mended.add((now - frame.t).ns());
      frame.t = now;
      frame.stamp = CameraStamp::kArrival;
    }
    const auto step = static_cast<std::int32_t>(frame.sequence - last_sequence_);  // right across the wrap
    if (!is_first_ && step <= 0) health_.out_of_order.add(frame.sequence);
    if (!is_first_ && step > 1) health_.missed.add(step - 1, static_cast<std::uint32_t>(step - 1));
    is_first_ = false;
    last_sequence_ = frame.sequence;
    if (frame.damaged) health_.damaged.add(frame.sequence);
    ++health_.received;
  }

  const CameraHealth& health() const { return health_; }

 private:
  CameraHealth health_;
  std::uint32_t last_sequence_ = 0;
  bool is_first_ = true;
};

}  // namespace plumb
