#pragma once
// A filter about to take in an image: a full window, features in the state, and tracks of every kind beside them.

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "fsw/estimator/visual_update.h"
#include "test/support/estimator_cases.h"

namespace plumb::test {

inline constexpr double kImageNoise_px = 0.5;
inline constexpr double kImageSigma = kImageNoise_px / 400.0;  ///< normalised image plane, nadir_calibration()

/// A track that is not in the state: seen by the poses first..last of the window.
struct NewTrack {
  std::uint32_t id = 0;
  std::size_t first = 0;
  std::size_t last = TinyConfig::kMaxPoses - 1;
  std::vector<Vec2> z;  ///< of pose first, first + 1, ...
};

inline Vec2 observe(Generator& g, const CameraPose& camera, const Vec3& point) {
  return feature_of(camera, point).head<2>() + g.normal_vector<2>(kImageSigma);
}

/// A true state off the estimate by a twentieth of what the prior allows: far enough to be corrected, near enough that
/// updates stay in the linear range and no track fails to triangulate.
inline FilterState<TinyConfig> true_state(Generator& g, const FilterState<TinyConfig>& state) {
  const Dense root = cholesky_factor(dense(state.covariance()));
  Eigen::VectorXd error(index(state.size()));
  for (Eigen::Index k = 0; k < error.size(); ++k) error(k) = 0.05 * g.normal(1.0);
  error = (root * error).eval();
  FilterState<TinyConfig> truth = state;
  truth.retract(error.data());
  return truth;
}

inline VisionOptions visual_case_options() {
  VisionOptions options;
  options.pixel_noise_px = kImageNoise_px;
  options.min_parallax_px = 1.0;
  return options;
}

struct VisualCase {
  using State = FilterState<TinyConfig>;
  using Visual = VisualUpdate<TinyConfig>;

  explicit VisualCase(const VisionOptions& options = visual_case_options())
      : visual(std::make_unique<Visual>(options, calibration, kMaxRanged)) {}

  static constexpr int kMaxRanged = 2;

  SensorCalibration calibration = nadir_calibration();
  std::unique_ptr<State> state = std::make_unique<State>();
  std::unique_ptr<Visual::Table> tracks = std::make_unique<Visual::Table>();
  std::unique_ptr<UpdateStack<TinyConfig>> stack = std::make_unique<UpdateStack<TinyConfig>>();
  std::unique_ptr<Visual> visual;
  std::vector<Vec2> slam_z;  ///< of the newest image, in order of feature
  std::vector<NewTrack> added;
  FrameReport report;

  Status run(const ScaleEvidence& scale = {}) {
    report = {};
    return visual->run(*state, *tracks, *stack, {0.2, 0.1}, scale, report, nullptr);
  }

  /// The whole window's images, oldest first, into the table of tracks.
  void append_frames() {
    for (std::size_t k = 0; k < TinyConfig::kMaxPoses; ++k) {
      FeatureFrame<TinyConfig::kMaxTracks> frame;
      frame.sequence = state->pose(state->window()[k]).sequence;
      const auto put = [&frame](std::uint32_t id, const Vec2& z) {
        EXPECT_EQ(frame.observations.push_back({id, 0.0F, 0.0F, z.x(), z.y()}), Status::kOk);
      };
      for (std::size_t i = 0; i < slam_z.size(); ++i) put(state->features[i].track_id, slam_z[i]);
      for (const NewTrack& t : added) {
        if (k >= t.first && k <= t.last) put(t.id, t.z[k - t.first]);
      }
      tracks->append(frame);
    }
  }

  /// `slam` features in the state, `started` tracks as long as the window and `ended` ones that the newest image lacks.
  void fill(Generator& g, std::size_t slam, std::size_t started, std::size_t ended) {
    fill_state(g, calibration, slam, *state);
    const State truth = true_state(g, *state);
    for (std::size_t i = 0; i < slam; ++i) {
      const SlamFeature& f = truth.features[i];
      const Vec3 point = feature_in_world(truth.pose(f.anchor_slot).camera, f.parameters);
      slam_z.push_back(observe(g, truth.newest().camera, point));
    }
    for (std::size_t i = 0; i < started + ended; ++i) {
      NewTrack t;
      t.id = static_cast<std::uint32_t>(200 + i);
      t.last = TinyConfig::kMaxPoses - (i < started ? 1 : 2);
      const Vec3 point = any_ground_point(g);
      for (std::size_t k = t.first; k <= t.last; ++k) {
        t.z.push_back(observe(g, truth.pose(truth.window()[k]).camera, point));
      }
      added.push_back(t);
    }
  }
};

}  // namespace plumb::test
