#pragma once
// One replay: a source flown through the navigation software, tick by tick.

#include <csignal>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "fsw/app/nav_system.h"
#include "tools/replay/outputs.h"
#include "tools/replay/session.h"

namespace plumb::replay {

/// Thrown when the user stops the replay.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted; no output was kept") {}
};

/// Told of everything that goes into and comes out of the flight software, in this order within a tick.
class FlightListener {
 public:
  virtual ~FlightListener() = default;
  virtual void on_input(const Tick&) {}
  virtual void on_predicted(const PredictedState&) {}
  virtual void on_image(const ImageRecord&) {}
  virtual void on_event(const Event&) {}
  virtual void on_health(const HealthRecord&) {}  ///< once per second of the recording
};

struct FlightOptions {
  std::string config_name;  ///< one of config_names()
  bool start_from_truth = false;
  bool realtime = false;  ///< hold every tick until as much time has passed as in the recording
  const volatile std::sig_atomic_t* stop = nullptr;  ///< not zero: give up with Interrupted
};

struct FlightTotals {
  std::uint64_t ticks = 0;
  std::uint64_t images_processed = 0;
  std::uint64_t images_valid = 0;
  Time t_first_valid = Time::never();
  std::uint64_t predicted = 0;
  std::uint64_t run_hash = 0;        ///< over image times and state hashes, in order
  std::vector<double> front_end_ms;  ///< CPU time, one per processed image
  std::vector<double> filter_ms;
  std::uint64_t filter_heap_calls = 0;  ///< inside the estimator's stages
  std::uint64_t fsw_heap_calls = 0;     ///< inside step(), the front end apart
  std::uint64_t front_end_heap_calls = 0;
  double wall_s = 0.0;
  EstimatorCounters estimator;
  NavSystemCounters system;
  PredictorCounters predictor;
  CalibrationReport calibration;  ///< at the end
  double pixel_noise_px = 0.0;    ///< at the end
  NavState last_state;
};

/// Throws InputError for what the source turns out to lack, Interrupted on request.
FlightTotals fly(Source& source, const FlightOptions& options, const std::vector<FlightListener*>& listeners);

/// Names of the mission configurations that fly() knows.
inline std::vector<std::string> config_names() {
  return {PaperConfig::kName, FlightConfig::kName, SelfCalibratingConfig::kName};
}

}  // namespace plumb::replay
