// The flight feeds an estimator in order and on time, and hands back what it said.

#include "test/support/sim/flight.h"

#include <gtest/gtest.h>

#include "test/support/sim/accuracy.h"

namespace plumb::sim {
namespace {

/// Stands in for the estimator: checks the order of its inputs and answers with the truth.
class ListeningEstimator {
 public:
  using Frame = FeatureFrame<200>;

  explicit ListeningEstimator(const Scene& scene) : scene_(scene) {}

  Status add_imu(const ImuSample& sample) {
    EXPECT_GT(sample.t, newest_imu_);
    newest_imu_ = sample.t;
    ++counters_.imu_samples;
    return Status::kOk;
  }
  Status add_range(const RangeSample& sample) {
    EXPECT_GT(sample.t, newest_range_);
    newest_range_ = sample.t;
    ++counters_.ranges;
    return Status::kOk;
  }
  Status add_direction(const DirectionSample&) { return Status::kOk; }
  bool imu_reaches(Time t) const { return newest_imu_ >= t; }
  MotionPrediction predict_motion(Time) const { return {}; }
  Status process(const Frame& frame) {
    EXPECT_GT(frame.t, state_.t);
    // As soon as the IMU reaches the image, with every range that is older than the image.
    EXPECT_LT(newest_imu_ - frame.t, Duration::from_ms(4));
    EXPECT_LT(frame.t - newest_range_, Duration::from_ms(40));
    const TruthState truth = scene_.trajectory.at((frame.t - flight_epoch()).seconds());
    const ImuModel imu(noise_free(), 250.0, 9.80665, 1);
    state_ = true_nav_state(truth, imu, frame.t);
    ++counters_.frames;
    return Status::kOk;
  }
  void start_from(const NavState& truth) { started_from_ = truth; }
  const NavState& state() const { return state_; }
  const FrameReport& report() const { return report_; }
  const EstimatorCounters& counters() const { return counters_; }
  std::uint64_t state_hash() const { return counters_.frames; }
  const NavState& started_from() const { return started_from_; }

 private:
  const Scene& scene_;
  Time newest_imu_ = Time::never();
  Time newest_range_ = Time::never();
  NavState state_;
  NavState started_from_;
  FrameReport report_;
  EstimatorCounters counters_;
};

TEST(Flight, FeedsInOrderAndLogsEveryImage) {
  const Scene scene = make_scene("outdoor_cruise_stepped");
  ListeningEstimator estimator(scene);
  const FlightLog log = Flight<ListeningEstimator>(scene, FlightSettings{}, estimator).fly();
  EXPECT_NEAR(static_cast<double>(log.points.size()), 75.0 * 30.0, 2.0);
  EXPECT_NEAR(static_cast<double>(log.counters.imu_samples), 75.0 * 250.0, 2.0);
  EXPECT_NEAR(static_cast<double>(log.counters.ranges), 75.0 * 25.0, 2.0);
  EXPECT_FALSE(estimator.started_from().valid);
  const Accuracy accuracy = evaluate(log);
  EXPECT_FALSE(accuracy.diverged);
  EXPECT_LT(accuracy.position_rmse_m, 1e-9);
}

TEST(Flight, HandsOverTheTruthOnRequest) {
  const Scene scene = make_scene("cruise_from_start");
  ListeningEstimator estimator(scene);
  FlightSettings settings;
  settings.start_from_truth = true;
  Flight<ListeningEstimator>(scene, settings, estimator).fly();
  EXPECT_TRUE(estimator.started_from().valid);
  EXPECT_EQ(estimator.started_from().v_WI_m_s[0], 2.0);
}

TEST(Flight, EverySceneCanBeFlown) {
  for (const std::string_view name : scene_names()) {
    const Scene scene = make_scene(name);
    ListeningEstimator estimator(scene);
    FlightSettings settings;
    settings.tracker.target_tracks = 40;
    const FlightLog log = Flight<ListeningEstimator>(scene, settings, estimator).fly();
    EXPECT_FALSE(evaluate(log).diverged) << name;
  }
  EXPECT_THROW(make_scene("nowhere"), std::invalid_argument);
}

}  // namespace
}  // namespace plumb::sim
