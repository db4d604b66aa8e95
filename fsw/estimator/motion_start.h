#pragma once
// Starting in motion: the velocity, tilt and biases that best explain how features flowed over half a second or more.
//
// Inside a short window the whole motion follows from the state at its beginning and the IMU, so the unknowns are the
// 15 core errors at the first image and one inverse depth per feature. Damped Gauss-Newton from "level by the mean
// specific force, not moving, everything equally far"; ranges fix the depth of the facet they hit. The filter starts at
// the window's last image with the solution carried there and its covariance. It does not see the window's images
// again: they are used up, and an EKF that fuses them around a scale known to ten percent takes its own changes of mind
// for knowledge of the scale.

#include <algorithm>
#include <span>

#include "fsw/estimator/imu_buffer.h"
#include "fsw/estimator/options.h"
#include "fsw/estimator/propagation.h"
#include "fsw/estimator/report.h"
#include "fsw/estimator/visual_model.h"
#include "fsw/math/matrix.h"

namespace plumb {

inline constexpr std::size_t kMaxStartImages = 12;
inline constexpr std::size_t kMaxStartRanges = 12;
inline constexpr std::size_t kMaxStartFeatures = 48;

struct StartObservation {
  std::size_t image = 0;  ///< index into StartProblem::images
  Vec2 z = Vec2::Zero();  ///< normalised image plane
};

/// A feature seen in the newest image of the window (its anchor) and in earlier ones.
struct StartFeature {
  Vec2 anchor_z = Vec2::Zero();
  FixedVector<StartObservation, kMaxStartImages> earlier;
};

struct StartRange {
  Time t;
  double range_m = 0.0;
};

struct StartProblem {
  FixedVector<Time, kMaxStartImages> images;  ///< oldest first
  FixedVector<StartFeature, kMaxStartFeatures> features;
  FixedVector<StartRange, kMaxStartRanges> ranges;  ///< between the first and the last image, in order
};

struct StartSolution {
  CoreState core;                                     ///< at the first image: position zero, yaw zero
  double velocity_sigma_m_s = 0.0;                    ///< root of the summed variances
  Mat15 covariance = Mat15::Zero();                   ///< of the right-invariant error at the first image
  double rms_px = 0.0;                                ///< of the reprojection residuals that were not down-weighted
  FixedVector<RangeOutcome, kMaxStartRanges> ranges;  ///< what became of each of the problem's

  std::size_t ranges_fitting() const {
    return static_cast<std::size_t>(std::count(ranges.begin(), ranges.end(), RangeOutcome::kUsed));
  }
};

class MotionStart {
 public:
  MotionStart(const EstimatorOptions& options, const SensorCalibration& calibration) : calibration_(calibration) {
    use(options);
  }
  /// Other options from here on.
  void use(const EstimatorOptions& options) {
    options_ = options;
    sigma_ = options.vision.pixel_noise_px / calibration_.focal_px;
  }

  /// kIllConditioned: too few features or no flow; kRejected: the residuals do not fit. Precondition: the IMU buffer
  /// spans the images.
  Result<StartSolution> solve(const StartProblem& problem, const ImuBuffer& imu);

 private:
  static constexpr std::size_t kMaxUnknowns = kCoreSize + kMaxStartFeatures;

  /// Where the camera was at an image or range, and how that depends on the core error at the start.
  struct Station {
    CameraPose camera;
    Eigen::Matrix<double, 6, 15, Eigen::RowMajor> by_start;
  };
  struct Estimate {
    CoreState core;
    std::array<double, kMaxStartFeatures> rho{};
  };

  Estimate first_guess(const StartProblem& problem, const ImuBuffer& imu) const;
  void integrate(const StartProblem& problem, const ImuBuffer& imu, const CoreState& core);
  /// Fills the normal equations at the estimate; returns the robust cost, infinite when a feature falls behind a
  /// camera.
  double linearise(const StartProblem& problem, const ImuBuffer& imu, const Estimate& estimate);
  double add_feature(const StartProblem& problem, std::size_t index, double rho);
  double add_range(const StartProblem& problem, std::size_t index, const Estimate& estimate);
  double add_prior(const CoreState& core);
  /// What one image says of a feature, whitened: the residual and what it depends on.
  struct FeatureRows {
    Vec2 residual = Vec2::Zero();
    Eigen::Matrix<double, 2, 15, Eigen::RowMajor> by_core;
    Mat2 by_anchor;  ///< by the error of the anchor observation, in sigmas
    Vec2 by_depth;
    double weight = 1.0;
  };
  /// By how much, in sigmas, the anchor observation is off for the rows to fit best; its own weight.
  struct AnchorFit {
    Vec2 offset = Vec2::Zero();
    double weight = 1.0;
  };
  static AnchorFit fit_anchor(std::span<const FeatureRows> rows);
  void add_rows(std::span<const FeatureRows> rows, double anchor_weight, std::size_t column);
  bool solve_step(double damping, std::size_t unknowns, double* step);
  /// Covariance of the core at the last linearisation, depths marginalised. False when it does not exist.
  bool core_covariance(std::size_t unknowns, Mat15& out);

  EstimatorOptions options_;
  SensorCalibration calibration_;
  double sigma_ = 0.0;  ///< pixel noise in the normalised plane
  std::array<Station, kMaxStartImages> images_;
  std::array<Station, kMaxStartRanges> ranges_;
  MatrixStorage<kMaxUnknowns, kMaxUnknowns> a_;
  MatrixStorage<kMaxUnknowns, kMaxUnknowns> factor_;
  double b_[kMaxUnknowns] = {};
  double squared_residuals_ = 0.0;
  std::size_t residuals_ = 0;
  FixedVector<RangeOutcome, kMaxStartRanges> range_outcomes_;  ///< at the last linearisation
};

}  // namespace plumb
