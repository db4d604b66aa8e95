#pragma once
// fly() for a feature tracker. flight.cpp has it for the one that flies.

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <thread>

#include "config/calibration_reader.h"
#include "config/input_error.h"
#include "fsw/base/hash.h"
#include "tools/replay/flight.h"
#include "tools/replay/heap_counter.h"
#include "tools/replay/stage_meter.h"

namespace plumb::replay {
namespace detail {

using Clock = std::chrono::steady_clock;

inline constexpr Duration kMaxTruthDistance = Duration::from_ms(50);  // further away it is the truth of something else

inline const NavState& truth_at_first_image(const Session& session) {
  if (session.truth.empty()) throw InputError(session.source + ": --start-from-truth needs a recording with truth");
  const auto distance_ns = [&session](const NavState& row) { return std::abs((row.t - session.t_first_image).ns()); };
  const NavState& nearest =
      *std::min_element(session.truth.begin(), session.truth.end(),
                        [&](const NavState& a, const NavState& b) { return distance_ns(a) < distance_ns(b); });
  if (distance_ns(nearest) > kMaxTruthDistance.ns()) {
    throw InputError(session.source + ": --start-from-truth needs truth within 50 ms of the first image, at " +
                     std::to_string(session.t_first_image.ns()) + " ns");
  }
  return nearest;
}

// The flight software in static memory, as it flies.
template <class Config, class ImageTracker>
class Flight {
 public:
  Flight(const Session& session, const FlightOptions& options)
      : tracker_(make_tracker(session)), system_(make_system(session, tracker_, meter_)) {
    if (options.start_from_truth) system_.start_from(truth_at_first_image(session));
  }

  void step(const Tick& tick, const std::vector<FlightListener*>& listeners) {
    for (FlightListener* listener : listeners) listener->on_input(tick);
    meter_.clear();
    const std::uint64_t heap_before = heap_calls();
    const std::int64_t cpu_before_ns = thread_cpu_ns();
    const NavTick& done = system_.step(tick.input, tick.input.has_camera ? &tick.image : nullptr);
    const StageCost cost{.cpu_ns = thread_cpu_ns() - cpu_before_ns, .heap_calls = heap_calls() - heap_before};
    ++totals_.ticks;
    totals_.fsw_heap_calls += cost.heap_calls - meter_.cost(Stage::kFrontEnd).heap_calls;
    for (const Event& event : done.events) {
      for (FlightListener* listener : listeners) listener->on_event(event);
    }
    for (const PredictedState& state : done.predicted) {
      totals_.predicted += state.status.valid ? 1 : 0;
      for (FlightListener* listener : listeners) listener->on_predicted(state);
    }
    if (done.image.processed) finish_image(cost, listeners);
    if (tick.input.t >= t_next_health_) {
      t_next_health_ = tick.input.t + kHealthPeriod;
      for (FlightListener* listener : listeners) listener->on_health(system_.health());
    }
  }

  FlightTotals totals() const {
    FlightTotals totals = totals_;
    totals.run_hash = run_hash_.value();
    totals.estimator = system_.estimator().counters();
    totals.system = system_.counters();
    totals.predictor = system_.predictor().counters();
    totals.calibration = system_.estimator().calibration();
    totals.pixel_noise_px = system_.estimator().pixel_noise_px();
    totals.last_state = system_.estimator().state();
    return totals;
  }

 private:
  static ImageTracker& make_tracker(const Session& session) {
    const CameraCalibration& camera = session.calibration.camera;
    if (camera.width > static_cast<std::int32_t>(Config::kMaxImageWidth) ||
        camera.height > static_cast<std::int32_t>(Config::kMaxImageHeight)) {
      throw InputError(session.source + ": resolution " + std::to_string(camera.width) + " x " +
                       std::to_string(camera.height) + " is beyond " + std::to_string(Config::kMaxImageWidth) + " x " +
                       std::to_string(Config::kMaxImageHeight) + ", the largest of configuration '" + Config::kName +
                       "'");
    }
    const auto conflicts = conflicts_in(session.parameters);
    if (!conflicts.empty()) throw InputError(session.source + ": " + conflicts[0]);
    if (!has_calibration_room<Config>(session.parameters.estimator.calibration))
      throw InputError(session.source + ": " + kCalibrationNeedsRoom);
    if (!ok(TrackerOptions::check(session.parameters.tracker, camera, Config::kMaxTracks))) {
      throw InputError(session.source + ": " + kTrackerNeedsRoom + ", found an image of " +
                       std::to_string(camera.width) + " x " + std::to_string(camera.height));
    }
    static std::optional<ImageTracker> tracker;
    return tracker.emplace(camera, session.parameters.tracker);
  }

  static NavSystem<Config>& make_system(const Session& session, ImageTracker& tracker, StageMeter& meter) {
    static std::optional<NavSystem<Config>> system;
    return system.emplace(session.calibration, session.parameters, tracker, &meter);
  }

  void finish_image(const StageCost& cost, const std::vector<FlightListener*>& listeners) {
    const ImageRecord record{.nav = system_.job().record(), .features = seen_features(), .meter = meter_, .step = cost};
    ++totals_.images_processed;
    if (record.nav.state.valid) {
      ++totals_.images_valid;
      if (totals_.t_first_valid == Time::never()) totals_.t_first_valid = record.nav.t_image;
    }
    run_hash_.add(static_cast<std::uint64_t>(record.nav.t_image.ns()));
    run_hash_.add(record.nav.state_hash);
    totals_.front_end_ms.push_back(static_cast<double>(meter_.cost(Stage::kFrontEnd).cpu_ns) * 1e-6);
    totals_.filter_ms.push_back(static_cast<double>(meter_.filter().cpu_ns) * 1e-6);
    totals_.front_end_heap_calls += meter_.cost(Stage::kFrontEnd).heap_calls;
    totals_.filter_heap_calls += meter_.filter().heap_calls;
    for (FlightListener* listener : listeners) listener->on_image(record);
  }

  std::vector<SeenFeature> seen_features() const {
    const auto& in_state = system_.estimator().slam_features();
    std::vector<SeenFeature> features;
    for (const FeatureObservation& seen : system_.job().features().observations) {
      const bool slam = std::any_of(in_state.begin(), in_state.end(),
                                    [&seen](const SlamFeature& feature) { return feature.track_id == seen.track_id; });
      features.push_back({.track_id = seen.track_id, .u_px = seen.u_px, .v_px = seen.v_px, .slam = slam});
    }
    return features;
  }

  static constexpr Duration kHealthPeriod = Duration::from_ms(1000);

  Time t_next_health_ = Time::never();
  StageMeter meter_;
  ImageTracker& tracker_;
  NavSystem<Config>& system_;
  FlightTotals totals_;
  Hash64 run_hash_;
};

inline void give_up_if_asked(const FlightOptions& options) {
  if (options.stop != nullptr && *options.stop != 0) throw Interrupted();
}

// Waits in short stretches, because a recording may have a long hole and the user no patience.
inline void wait_until(Clock::time_point due, const FlightOptions& options) {
  constexpr std::chrono::milliseconds kStretch{100};
  for (Clock::time_point now = Clock::now(); now < due; now = Clock::now()) {
    give_up_if_asked(options);
    std::this_thread::sleep_until(std::min(due, now + kStretch));
  }
}

template <class Config, class ImageTracker>
FlightTotals fly_with(Source& source, const FlightOptions& options, const std::vector<FlightListener*>& listeners) {
  Flight<Config, ImageTracker> flight(source.session(), options);
  const Clock::time_point started = Clock::now();
  Time t_start = Time::never();
  Tick tick;
  while (source.next(tick)) {
    give_up_if_asked(options);
    if (t_start == Time::never()) t_start = tick.input.t;
    if (options.realtime) wait_until(started + std::chrono::nanoseconds((tick.input.t - t_start).ns()), options);
    flight.step(tick, listeners);
  }
  FlightTotals totals = flight.totals();
  totals.wall_s = std::chrono::duration<double>(Clock::now() - started).count();
  return totals;
}

}  // namespace detail

/// What fly() promises, with Tracker<Config> in the front end.
template <template <class Config> class Tracker>
FlightTotals fly_by(Source& source, const FlightOptions& options, const std::vector<FlightListener*>& listeners) {
  const auto with = [&]<class Config>(Config) {
    return detail::fly_with<Config, Tracker<Config>>(source, options, listeners);
  };
  if (options.config_name == PaperConfig::kName) return with(PaperConfig{});
  if (options.config_name == FlightConfig::kName) return with(FlightConfig{});
  if (options.config_name == SelfCalibratingConfig::kName) return with(SelfCalibratingConfig{});
  throw InputError("unknown configuration '" + options.config_name + "'");
}

}  // namespace plumb::replay
