#include "fsw/vision/ransac.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "fsw/vision/two_view_fit.h"

namespace plumb {
namespace {

using namespace two_view;

constexpr std::size_t kMinMatches = 8;  // below this five unknowns and an outlier cannot be told apart
constexpr int kIterations = 60;         // half outliers: a pair of inliers is missed with probability 3e-8
constexpr int kRotationIterations = 8;  // reweighted steps from identity
constexpr int kRefineIterations = 6;
constexpr double kMinInlierShare = 0.5;   // less agreement than this is a failure of the model, not of the tracks
constexpr double kBlindScale_rad = 0.05;  // flow between images that counts when nothing is known of the rotation
constexpr double kScaleDecay = 0.6;       // of the robust scale, from one reweighting to the next
constexpr double kTurnShare = 0.9;        // of the inliers: when turning alone explains that many, it is all there was
constexpr double kTiny = 1e-24;
constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// Two unit vectors that span the plane normal to the unit vector v.
void tangent_basis(const Vec3& v, Vec3& e1, Vec3& e2) {
  e1 = std::fabs(v.x()) < 0.6 ? v.cross(Vec3::UnitX()) : v.cross(Vec3::UnitY());
  e1.normalize();
  e2 = v.cross(e1);
}

}  // namespace

// Robust least squares on the flow that is left. The scale of the robust weight shrinks to the threshold, so that first
// everything has a say and in the end only what turns with the camera.
Quat TwoViewRansac::fit_rotation(const Quat& q_start, double scale_rad) const {
  Quat q = q_start;
  for (int iteration = 0; iteration < kRotationIterations; ++iteration) {
    TurnEquations equations;
    for (std::size_t i = 0; i < count_; i += kLanes) {
      const Vectors turned = turn(q, Vectors::at(previous_, i));
      equations.add(turned, Vectors::at(current_, i) - turned, scale_rad, std::min(kLanes, count_ - i));
    }
    const Vec3 step = equations.information.ldlt().solve(equations.gradient);
    if (!step.allFinite()) return q_start;
    q = (so3_exp(step) * q).normalized();
    scale_rad = std::fmax(kScaleDecay * scale_rad, options_.threshold_rad);
  }
  return q;
}

void TwoViewRansac::take(std::span<const BearingMatch> matches) {
  static_assert(kMaxMatches % kLanes == 0);
  count_ = matches.size();
  for (std::size_t i = 0; i < count_ || i % kLanes != 0; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      previous_[k][i] = i < count_ ? matches[i].previous_C1[axis] : 0.0;
      current_[k][i] = i < count_ ? matches[i].current_C2[axis] : 0.0;
    }
  }
}

void TwoViewRansac::derotate(const Mat3& R_C2C1) {
  const Vectors x = Vectors::all(R_C2C1.row(0));
  const Vectors y = Vectors::all(R_C2C1.row(1));
  const Vectors z = Vectors::all(R_C2C1.row(2));
  for (std::size_t i = 0; i < count_; i += kLanes) {
    const Vectors previous = Vectors::at(previous_, i);
    const Vectors current = Vectors::at(current_, i);
    const Vectors derotated{x.dot(previous), y.dot(previous), z.dot(previous)};
    derotated.keep(derotated_, i);
    (current - derotated).keep(flow_, i);
    derotated.cross(current).keep(normal_, i);
  }
}

// Points ahead of both cameras can only move towards t, so that flow away from t is as wrong as flow across the
// epipolar plane. The sine of the angle to the epipole is limited so that the distance is finite there.
double TwoViewRansac::squared_distance(const Vec3& direction, std::size_t i) const {
  const auto along = [&direction, i](const Components& all) {
    return direction.dot(Vec3(all[0][i], all[1][i], all[2][i]));
  };
  const double cosine = along(derotated_);
  const double across = along(normal_);
  const double backward = std::min(along(flow_), 0.0);
  return (across * across + backward * backward) / std::max(1.0 - cosine * cosine, kEpipoleFloor);
}

// Truncated squared distance (MSAC): among hypotheses with equal support the tighter one wins. Turns the direction
// round where that is better. Stops counting once neither way can cost less than `bound`.
double TwoViewRansac::cost_of(Vec3& direction, double threshold_rad, double bound) const {
  const Doubles zero = cv::v_setzero_f64();
  const Doubles one = cv::v_setall_f64(1.0);
  const Doubles limit = cv::v_setall_f64(threshold_rad * threshold_rad);
  const Doubles floor = cv::v_setall_f64(kEpipoleFloor);
  const std::array<Doubles, 3> t = {cv::v_setall_f64(direction.x()), cv::v_setall_f64(direction.y()),
                                    cv::v_setall_f64(direction.z())};
  const auto along_t = [&t](const Components& all, std::size_t i) {
    return t[0] * cv::v_load(&all[0][i]) + t[1] * cv::v_load(&all[1][i]) + t[2] * cv::v_load(&all[2][i]);
  };
  Doubles sums = zero;  // towards, away
  for (std::size_t i = 0; i < count_; i += Doubles::nlanes) {
    const Doubles cosine = along_t(derotated_, i);
    const Doubles along = along_t(flow_, i);
    const Doubles off = along_t(normal_, i);
    const Doubles inverse = one / cv::v_max(one - cosine * cosine, floor);
    const Doubles across = off * off * inverse;
    const Doubles both = across + along * along * inverse;
    const Doubles towards = cv::v_min(cv::v_select(along < zero, both, across), limit);
    const Doubles away = cv::v_min(cv::v_select(along > zero, both, across), limit);
    Doubles first;
    Doubles second;
    cv::v_zip(towards, away, first, second);
    sums = sums + first + second;
    if (cv::v_check_all(sums >= cv::v_setall_f64(bound))) return bound;
  }
  std::array<double, Doubles::nlanes> both_ways;
  cv::v_store(both_ways.data(), sums);
  const auto [towards, away] = both_ways;
  if (towards <= away) return towards;
  direction = -direction;
  return away;
}

void TwoViewRansac::search(double threshold_rad, Model& best) {
  best.cost = cost_of(best.direction, threshold_rad, kUnbounded);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const std::uint32_t n = static_cast<std::uint32_t>(count_);
    const std::uint32_t i = generator_.below(n);
    const std::uint32_t j = (i + 1 + generator_.below(n - 1)) % n;
    const Vec3 direction = normal(i).cross(normal(j));
    const double norm2 = direction.squaredNorm();
    if (!(norm2 > kTiny)) continue;
    Vec3 unit = direction / std::sqrt(norm2);
    const double cost = cost_of(unit, threshold_rad, best.cost);
    if (cost < best.cost) {
      best.cost = cost;
      best.direction = unit;
    }
  }
}

// Minimises sum rho(distance of b2 to where Exp(d) b1' can move along t) + |d|^2 / sigma^2 over the small rotation d
// and the unit vector t.
void TwoViewRansac::refine(double sigma_rad, double scale_rad, Model& model) {
  const double prior = (options_.threshold_rad / sigma_rad) * (options_.threshold_rad / sigma_rad);
  for (int iteration = 0; iteration < kRefineIterations; ++iteration) {
    derotate((model.q_correction * model.q_start).toRotationMatrix());
    Vec3 e1;
    Vec3 e2;
    tangent_basis(model.direction, e1, e2);
    NormalEquations equations;
    const Tangent tangent{Vectors::all(model.direction), Vectors::all(e1), Vectors::all(e2)};
    for (std::size_t i = 0; i < count_; i += kLanes) {
      const Matches seen{Vectors::at(current_, i), Vectors::at(derotated_, i), Vectors::at(flow_, i),
                         Vectors::at(normal_, i)};
      add_rows(seen, tangent, scale_rad, std::min(kLanes, count_ - i), equations);
    }
    equations.information.topLeftCorner<3, 3>().diagonal().array() += prior;
    equations.gradient.head<3>() -= prior * so3_log(model.q_correction);
    const Vec5 step = equations.information.ldlt().solve(equations.gradient);
    if (!step.allFinite()) return;
    model.q_correction = (so3_exp(step.head<3>()) * model.q_correction).normalized();
    model.direction = (model.direction + step[3] * e1 + step[4] * e2).normalized();
    scale_rad = std::fmax(kScaleDecay * scale_rad, options_.threshold_rad);
  }
}

void TwoViewRansac::judge(const Vec3& direction, Outcome& out) const {
  const double limit = options_.threshold_rad * options_.threshold_rad;
  out.inliers = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    out.inlier[i] = squared_distance(direction, i) <= limit;
    if (out.inlier[i]) ++out.inliers;
  }
}

TwoViewRansac::Model TwoViewRansac::solve(const Quat& q_start, double sigma_rad) {
  const double wide_rad = options_.threshold_rad + options_.rotation_sigma_rad;
  Model model;
  model.q_start = q_start;
  derotate(q_start.toRotationMatrix());
  search(wide_rad, model);
  refine(sigma_rad, wide_rad, model);
  derotate((model.q_correction * q_start).normalized().toRotationMatrix());
  search(options_.threshold_rad, model);
  refine(sigma_rad, options_.threshold_rad, model);
  derotate((model.q_correction * q_start).normalized().toRotationMatrix());
  model.cost = cost_of(model.direction, options_.threshold_rad, kUnbounded);
  return model;
}

// Without parallax the direction is arbitrary, and so is the part of the rotation that looks like it. The rotation that
// explains the matches alone is then the better one.
void TwoViewRansac::prefer_turning_alone(std::span<const BearingMatch> matches, const Quat& q_turn,
                                         Outcome& out) const {
  const double limit = options_.threshold_rad * options_.threshold_rad;
  std::size_t turning = 0;
  for (const BearingMatch& match : matches) {
    if ((q_turn * match.previous_C1 - match.current_C2).squaredNorm() <= limit) ++turning;
  }
  if (static_cast<double>(turning) >= kTurnShare * static_cast<double>(out.inliers)) out.q_C2C1 = q_turn;
}

Status TwoViewRansac::reject(std::span<const BearingMatch> matches, const Quat* q_C2C1, Outcome& out) {
  out.judged = false;
  out.inliers = matches.size();
  out.inlier.fill(true);
  out.direction_C2.setZero();
  out.q_C2C1 = q_C2C1 != nullptr ? *q_C2C1 : Quat::Identity();
  if (matches.size() > kMaxMatches) return Status::kFull;
  if (!out.q_C2C1.coeffs().allFinite()) return Status::kInvalidValue;
  for (const BearingMatch& match : matches) {
    if (!match.previous_C1.allFinite() || !match.current_C2.allFinite()) return Status::kInvalidValue;
  }
  if (matches.size() < kMinMatches) return Status::kOk;

  take(matches);
  const bool blind = q_C2C1 == nullptr;
  const Quat q_given = blind ? fit_rotation(Quat::Identity(), kBlindScale_rad) : q_C2C1->normalized();
  const double sigma_rad = blind ? options_.blind_rotation_sigma_rad : options_.rotation_sigma_rad;
  const Quat q_turn = fit_rotation(q_given, options_.threshold_rad + options_.rotation_sigma_rad);
  // With parallax the given rotation is the better start, without it the one that explains the most flow.
  Model model = solve(q_given, sigma_rad);
  const Model from_turn = solve(q_turn, sigma_rad);
  if (from_turn.cost < model.cost) model = from_turn;
  out.q_C2C1 = (model.q_correction * model.q_start).normalized();
  derotate(out.q_C2C1.toRotationMatrix());
  judge(model.direction, out);
  if (static_cast<double>(out.inliers) < kMinInlierShare * static_cast<double>(matches.size())) {
    out.inliers = matches.size();
    out.inlier.fill(true);
    out.q_C2C1 = q_given;
    return Status::kOk;
  }
  out.judged = true;
  out.direction_C2 = model.direction;
  prefer_turning_alone(matches, q_turn, out);
  return Status::kOk;
}

}  // namespace plumb
