#pragma once
// Outlier rejection between two images whose relative rotation the gyro gives, up to a small error (an uncalibrated
// gyro bias of 0.08 rad/s turns the camera by 4 mrad between 20 Hz images, which is 2 px). With the rotation known, two
// matches fix the direction of the translation:
//   b1' = R b1,  n = b1' x b2,  t = n_i x n_j,  residual = angle from b2 to the epipolar plane of b1' and t.
// A first search with a wide threshold gives the support from which the small rotation error and t are refined together
// (Gauss-Newton with a prior on the rotation); a second search with the narrow threshold then judges every match.
// Without parallax t is arbitrary, and every match that agrees with the rotation passes, because the distance to any
// epipolar plane is at most the distance between b1' and b2.
//
// Cost: each match takes part in at most 2 starts * 2 searches * (60 hypotheses + 1) costs of a direction, 2 * 2 * 6
// normal equations of five unknowns, 2 * 8 of three, and 31 rotations, whatever the matches are. Nothing is sorted.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "fsw/base/status.h"
#include "fsw/math/so3.h"
#include "fsw/vision/two_view_fit.h"

namespace plumb {

/// A small seeded generator (PCG-XSH-RR 64/32, O'Neill 2014). Its state is the state of whoever owns it.
class Pcg32 {
 public:
  explicit constexpr Pcg32(std::uint64_t seed) : state_(seed * kMultiplier + kIncrement) {}
  constexpr std::uint32_t next() {
    const std::uint64_t old = state_;
    state_ = old * kMultiplier + kIncrement;
    const auto shifted = static_cast<std::uint32_t>(((old >> 18U) ^ old) >> 27U);
    const auto rotation = static_cast<std::uint32_t>(old >> 59U);
    return (shifted >> rotation) | (shifted << ((32U - rotation) & 31U));
  }
  /// In [0, bound), without division; the bias of bound / 2^32 does not matter here. Precondition: bound > 0.
  constexpr std::uint32_t below(std::uint32_t bound) {
    return static_cast<std::uint32_t>((static_cast<std::uint64_t>(next()) * bound) >> 32U);
  }

 private:
  static constexpr std::uint64_t kMultiplier = 6364136223846793005ULL;
  static constexpr std::uint64_t kIncrement = 1442695040888963407ULL;
  std::uint64_t state_;
};

/// One match: unit vectors towards the same point, each in its own camera frame.
struct BearingMatch {
  Vec3 previous_C1 = Vec3::UnitZ();
  Vec3 current_C2 = Vec3::UnitZ();
};

struct RansacOptions {
  double threshold_rad = 2.5e-3;           ///< distance to the epipolar plane above which a match is an outlier
  double rotation_sigma_rad = 3.0e-3;      ///< error of the given rotation, per axis
  double blind_rotation_sigma_rad = 0.02;  ///< the same when the rotation had to be fitted to the matches
  std::uint64_t seed = 0x9E3779B97F4A7C15ULL;
};

class TwoViewRansac {
 public:
  static constexpr std::size_t kMaxMatches = two_view::Matches::kMost;

  struct Outcome {
    /// False: too few matches, or no motion that most of them agree with. Nothing was rejected then: throwing every
    /// track away would blind the filter, which has gates of its own.
    bool judged = false;
    std::size_t inliers = 0;
    std::array<bool, kMaxMatches> inlier{};
    Quat q_C2C1 = Quat::Identity();    ///< the rotation used in the end
    Vec3 direction_C2 = Vec3::Zero();  ///< unit direction in which points move (C1's origin seen from C2)
  };

  explicit TwoViewRansac(const RansacOptions& options) : options_(options), generator_(options.seed) {}
  void set_threshold_rad(double threshold_rad) { options_.threshold_rad = threshold_rad; }
  /// Starts again as if new.
  void reset() { generator_ = Pcg32(options_.seed); }

  /// Judges the matches. q_C2C1 rotates vectors from the previous to the present camera frame; without it (null) the
  /// rotation is fitted to the matches. kFull with more than kMaxMatches, kInvalidValue when the rotation or a vector
  /// is not finite; `out` is then not judged.
  [[nodiscard]] Status reject(std::span<const BearingMatch> matches, const Quat* q_C2C1, Outcome& out);

 private:
  struct Model {
    Quat q_start = Quat::Identity();       ///< C1 to C2, before the correction
    Quat q_correction = Quat::Identity();  ///< in C2
    Vec3 direction = Vec3::UnitX();
    float cost = 0.0F;
  };
  Quat fit_rotation(const Quat& q_start, double scale_rad) const;
  void prefer_turning_alone(std::span<const BearingMatch> matches, const Quat& q_turn, Outcome& out) const;
  void take(std::span<const BearingMatch> matches);
  void derotate(const Mat3& R_C2C1);
  double squared_distance(const Vec3& direction, std::size_t i) const;
  Vec3 normal(std::size_t i) const { return {matches_.normal[0][i], matches_.normal[1][i], matches_.normal[2][i]}; }
  float cost_of(Vec3& direction, double threshold_rad, float bound) const;
  void search(double threshold_rad, Model& best);
  void refine(double sigma_rad, double scale_rad, Model& model);
  Model solve(const Quat& q_start, double sigma_rad);
  void judge(const Vec3& direction, Outcome& out) const;

  RansacOptions options_;
  Pcg32 generator_;
  two_view::Matches matches_;
};

}  // namespace plumb
