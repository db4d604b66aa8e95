#include "fsw/vision/ransac.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

namespace plumb {
namespace {

constexpr std::size_t kMinMatches = 8;  // below this five unknowns and an outlier cannot be told apart
constexpr int kIterations = 60;         // half outliers: a pair of inliers is missed with probability 3e-8
constexpr int kRotationIterations = 8;  // reweighted steps from identity
constexpr int kRefineIterations = 6;
constexpr double kMinInlierShare = 0.5;   // less agreement than this is a failure of the model, not of the tracks
constexpr double kBlindScale_rad = 0.05;  // flow between images that counts when nothing is known of the rotation
constexpr double kScaleDecay = 0.6;       // of the robust scale, from one reweighting to the next
constexpr double kTurnShare = 0.9;        // of the inliers: when turning alone explains that many, it is all there was
constexpr double kTiny = 1e-24;
constexpr float kUnbounded = std::numeric_limits<float>::infinity();

two_view::Triple triple(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

template <std::size_t N>
using VectorOf = Eigen::Matrix<double, static_cast<int>(N), 1>;

template <std::size_t N>
VectorOf<N> solution_of(const two_view::NormalEquations<N>& equations) {
  using Information = Eigen::Matrix<double, static_cast<int>(N), static_cast<int>(N)>;
  static_assert(sizeof(equations.information) == N * N * sizeof(double));
  const Eigen::Map<const Information> information(equations.information[0].data());
  return information.ldlt().solve(Eigen::Map<const VectorOf<N>>(equations.gradient.data()));
}

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
    const Vec3 step = solution_of(two_view::turn_equations(matches_, {q.w(), q.x(), q.y(), q.z()}, scale_rad));
    if (!step.allFinite()) return q_start;
    q = (so3_exp(step) * q).normalized();
    scale_rad = std::fmax(kScaleDecay * scale_rad, options_.threshold_rad);
  }
  return q;
}

void TwoViewRansac::take(std::span<const BearingMatch> matches) {
  matches_.count = matches.size();
  for (std::size_t i = 0; i < matches_.count || i % matches_.kWhole != 0; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      matches_.previous[k][i] = i < matches_.count ? matches[i].previous_C1[axis] : 0.0;
      matches_.current[k][i] = i < matches_.count ? matches[i].current_C2[axis] : 0.0;
    }
  }
}

void TwoViewRansac::derotate(const Mat3& R_C2C1) {
  two_view::derotate(matches_, {triple(R_C2C1.row(0)), triple(R_C2C1.row(1)), triple(R_C2C1.row(2))});
}

// Points ahead of both cameras can only move towards t, so that flow away from t is as wrong as flow across the
// epipolar plane. The sine of the angle to the epipole is limited so that the distance is finite there.
double TwoViewRansac::squared_distance(const Vec3& direction, std::size_t i) const {
  const auto along = [&direction, i](const two_view::Matches::Components& all) {
    return direction.dot(Vec3(all[0][i], all[1][i], all[2][i]));
  };
  const double cosine = along(matches_.derotated);
  const double across = along(matches_.normal);
  const double backward = std::min(along(matches_.flow), 0.0);
  return (across * across + backward * backward) / std::max(1.0 - cosine * cosine, two_view::kEpipoleFloor);
}

// Truncated squared distance (MSAC): among hypotheses with equal support the tighter one wins. Turns the direction
// round where that is better. Stops counting once neither way can cost less than `bound`.
float TwoViewRansac::cost_of(Vec3& direction, double threshold_rad, float bound) const {
  const two_view::Cost cost = two_view::cost_of(matches_, triple(direction), threshold_rad, bound);
  if (cost.towards <= cost.away) return cost.towards;
  direction = -direction;
  return cost.away;
}

void TwoViewRansac::search(double threshold_rad, Model& best) {
  two_view::round_for_costs(matches_);
  best.cost = cost_of(best.direction, threshold_rad, kUnbounded);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const std::uint32_t n = static_cast<std::uint32_t>(matches_.count);
    const std::uint32_t i = generator_.below(n);
    const std::uint32_t j = (i + 1 + generator_.below(n - 1)) % n;
    const Vec3 direction = normal(i).cross(normal(j));
    const double norm2 = direction.squaredNorm();
    if (!(norm2 > kTiny)) continue;
    Vec3 unit = direction / std::sqrt(norm2);
    const float cost = cost_of(unit, threshold_rad, best.cost);
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
    two_view::NormalEquations<5> equations =
        two_view::move_equations(matches_, {triple(model.direction), triple(e1), triple(e2)}, scale_rad);
    const Vec3 turned = so3_log(model.q_correction);
    for (std::size_t k = 0; k < 3; ++k) {
      equations.information[k][k] += prior;
      equations.gradient[k] -= prior * turned[static_cast<Eigen::Index>(k)];
    }
    const VectorOf<5> step = solution_of(equations);
    if (!step.allFinite()) return;
    model.q_correction = (so3_exp(step.head<3>()) * model.q_correction).normalized();
    model.direction = (model.direction + step[3] * e1 + step[4] * e2).normalized();
    scale_rad = std::fmax(kScaleDecay * scale_rad, options_.threshold_rad);
  }
}

void TwoViewRansac::judge(const Vec3& direction, Outcome& out) const {
  const double limit = options_.threshold_rad * options_.threshold_rad;
  out.inliers = 0;
  for (std::size_t i = 0; i < matches_.count; ++i) {
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
  two_view::round_for_costs(matches_);
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
