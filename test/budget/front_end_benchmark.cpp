// What the front end costs an image, on the kernels that fly, on OpenCV's, and on the own ones without vectors, for
// which this file is compiled once more, with plumb_scalar for the name of the namespace.
//
//   build/flight/bin/plumb-bench [--benchmark_filter=Track]

#include <benchmark/benchmark.h>

#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "fsw/vision/flight_tracker.h"
#if !defined(CV_FORCE_SIMD128_CPP)
#include "test/support/opencv_tracker/opencv_tracker.h"
#endif
#include "test/support/property.h"
#include "test/unit/vision/lenses.h"
#include "test/unit/vision/textures.h"

namespace plumb {
namespace {

using Flown = FlightKernels<FlightConfig::kMaxImageWidth, FlightConfig::kMaxImageHeight>;
constexpr std::size_t kMaxTracks = FlightConfig::kMaxTracks;
constexpr int kTravel_px = 40;

/// A texture that passes by at 2 px an image, to and fro.
class Passing {
 public:
  Passing() {
    cv::setNumThreads(1);
    test::Generator g(test::base_seed());
    const CameraCalibration lens = test::euroc_lens();
    texture_ = cv::Mat(lens.height + kTravel_px, lens.width + kTravel_px, CV_8UC1);
    const cv::Mat fine = test::random_texture(g, texture_.cols, texture_.rows);
    cv::GaussianBlur(fine, texture_, cv::Size(), 2.5);
    cv::normalize(texture_, texture_, 0, 255, cv::NORM_MINMAX);
  }
  ImageView image(int i) const {
    const int phase = 2 * i % (2 * kTravel_px);
    const int shift = phase < kTravel_px ? phase : 2 * kTravel_px - phase;
    const CameraCalibration lens = test::euroc_lens();
    return test::view_of(texture_(cv::Rect(shift, shift / 2, lens.width, lens.height)));
  }

 private:
  cv::Mat texture_;
};

template <class Kernels>
void Push(benchmark::State& state) {
  const Passing passing;
  const auto kernels = std::make_unique<Kernels>(test::euroc_lens(), TrackerOptions{});
  int i = 0;
  for (auto _ : state) kernels->push(passing.image(i++));
}

/// Whole image, in tiles, at the usual threshold.
template <class Kernels>
void Detect(benchmark::State& state) {
  const Passing passing;
  const TrackerOptions options;
  const CameraCalibration lens = test::euroc_lens();
  const auto kernels = std::make_unique<Kernels>(lens, options);
  kernels->push(passing.image(0));
  const TileGrid<kMaxTiles> tiles(lens.width, lens.height, options.tile_columns, options.tile_rows, options.border_px);
  const auto mask = std::make_unique<SpacingMask>(lens.width, lens.height, 0);
  for (auto _ : state) {
    for (std::size_t tile = 0; tile < tiles.size(); ++tile) {
      BestCorners<kCornersPerTile> best;
      CornerSink sink(*mask, best);
      kernels->detect(tiles.rect(tile), 20, sink);
      benchmark::DoNotOptimize(sink.offered());
    }
  }
}

/// As many points as are tracked, searched from 1 px beside.
template <class Kernels>
void Follow(benchmark::State& state) {
  const Passing passing;
  const auto kernels = std::make_unique<Kernels>(test::euroc_lens(), TrackerOptions{});
  kernels->push(passing.image(0));
  kernels->push(passing.image(1));
  std::vector<FlowPoint> asked;
  for (int i = 0; i < TrackerOptions{}.max_features; ++i) {
    const auto u = static_cast<float>(40 + 45 * (i % 15));
    const auto v = static_cast<float>(40 + 40 * (i / 15));
    asked.push_back({u, v, u - 1.0F, v - 1.5F});
  }
  for (auto _ : state) {
    std::vector<FlowPoint> points = asked;
    kernels->follow(points);
    benchmark::DoNotOptimize(points.data());
  }
}

template <class Kernels>
void Track(benchmark::State& state) {
  const Passing passing;
  const auto tracker = std::make_unique<FeatureTracker<kMaxTracks, Kernels>>(test::euroc_lens(), TrackerOptions{});
  FeatureFrame<kMaxTracks> out;
  int i = 0;
  for (auto _ : state) {
    const CameraFrame frame{Time::from_ns(1 + 50'000'000LL * i), static_cast<std::uint32_t>(i), passing.image(i)};
    benchmark::DoNotOptimize(tracker->track(frame, MotionPrediction{}, out));
    ++i;
  }
  state.counters["features"] = static_cast<double>(out.observations.size());
}

#define PLUMB_BENCH(stage, kernels) BENCHMARK_TEMPLATE(stage, kernels)->Unit(benchmark::kMillisecond)
#define PLUMB_BENCH_ALL(kernels) \
  PLUMB_BENCH(Push, kernels);    \
  PLUMB_BENCH(Detect, kernels);  \
  PLUMB_BENCH(Follow, kernels);  \
  PLUMB_BENCH(Track, kernels)

#if defined(CV_FORCE_SIMD128_CPP)
using WithoutVectors = Flown;
PLUMB_BENCH_ALL(WithoutVectors);
#else
PLUMB_BENCH_ALL(Flown);
PLUMB_BENCH_ALL(OpenCvKernels);
#endif

}  // namespace
}  // namespace plumb
