// Flies a recording with a mark at every border between stages, for instruction_budget.py to count what each costs.
//
//   plumb-instruction-budget RECORDING CONFIGURATION [IMAGES [PARAMETERS]]

#include <cinttypes>
#include <cstdio>
#include <optional>
#include <string>

#include "config/input_error.h"
#include "fsw/app/nav_system.h"
#include "fsw/vision/feature_tracker_impl.h"
#include "fsw/vision/flight_kernels.h"
#include "test/budget/budget_program.h"
#include "test/budget/instruction_mark.h"
#include "tools/replay/asl_reader.h"

namespace plumb::budget {
namespace {

/// The kernels that fly, with marks.
template <class Config>
class MarkedKernels {
 public:
  MarkedKernels(const CameraCalibration& calibration, const TrackerOptions& options) : kernels_(calibration, options) {}
  void push(const ImageView& image) {
    const RegionScope scope(Region::kPyramid);
    kernels_.push(image);
  }
  void forget() { kernels_.forget(); }
  ImageView present() const { return kernels_.present(); }
  void follow(std::span<FlowPoint> points) const {
    const RegionScope scope(Region::kFlow);
    kernels_.follow(points);
  }
  void detect(const TileRect& rect, std::int32_t threshold, CornerSink& sink) const {
    const RegionScope scope(Region::kDetect);
    kernels_.detect(rect, threshold, sink);
  }

 private:
  FlightKernels<Config::kMaxImageWidth, Config::kMaxImageHeight> kernels_;
};

/// Whether the state counts, and the state as a line of a TUM file.
void print(const NavState& state) {
  constexpr std::int64_t kNsPerS = 1'000'000'000;
  const std::int64_t t_ns = state.valid ? state.t.ns() : 0;
  std::printf("%d %" PRId64 ".%09" PRId64, state.valid ? 1 : 0, t_ns / kNsPerS, t_ns % kNsPerS);
  for (const double value : state.p_WI_m) std::printf(" %.6f", value);
  const auto [w, x, y, z] = state.q_WI;
  std::printf(" %.9f %.9f %.9f %.9f\n", x, y, z, w);
}

template <class Config>
void fly(replay::Source& source, std::size_t images) {
  static std::optional<FeatureTracker<Config::kMaxTracks, MarkedKernels<Config>>> tracker;
  static std::optional<NavSystem<Config>> system;
  MarkingObserver observer;
  const replay::Session& session = source.session();
  tracker.emplace(session.calibration.camera, session.parameters.tracker);
  system.emplace(session.calibration, session.parameters, *tracker, &observer);

  replay::Tick tick;
  std::size_t done = 0;
  while (done < images && source.next(tick)) {
    bool image_processed = false;
    {
      const RegionScope scope(Region::kStep);
      image_processed = system->step(tick.input, tick.input.has_camera ? &tick.image : nullptr).image.processed;
    }
    if (!image_processed) continue;
    ++done;
    end(static_cast<std::uint8_t>(Region::kImage));
    print(system->estimator().state());
  }
}

int run(int argc, char** argv) {
  if (argc < 3 || argc > 5) {
    std::fprintf(stderr, "usage: %s RECORDING CONFIGURATION [IMAGES [PARAMETERS]]\n", argv[0]);
    return 2;
  }
  const std::string config = argv[2];
  const std::size_t images = images_wanted(argc, argv, 3);
  const auto source = replay::open_asl({.folder = argv[1], .parameters = argc > 4 ? argv[4] : ""});
  if (config == PaperConfig::kName)
    fly<PaperConfig>(*source, images);
  else if (config == FlightConfig::kName)
    fly<FlightConfig>(*source, images);
  else if (config == SelfCalibratingConfig::kName)
    fly<SelfCalibratingConfig>(*source, images);
  else
    throw InputError("unknown configuration '" + config + "'");
  return 0;
}

}  // namespace
}  // namespace plumb::budget

int main(int argc, char** argv) { return plumb::budget::exit_code_of(plumb::budget::run, argc, argv); }
