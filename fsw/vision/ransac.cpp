#include "fsw/vision/ransac.h"

#include <cmath>

#include <Eigen/Cholesky>

namespace plumb {
namespace {

using Vec5 = Eigen::Matrix<double, 5, 1>;
using Mat5 = Eigen::Matrix<double, 5, 5>;

constexpr std::size_t kMinMatches = 8;  // below this five unknowns and an outlier cannot be told apart
constexpr int kIterations = 60;         // half outliers: a pair of inliers is missed with probability 3e-8
constexpr int kRotationIterations = 8;  // reweighted steps from identity
constexpr int kRefineIterations = 5;
constexpr double kMinInlierShare = 0.5;         // less agreement than this is a failure of the model, not of the tracks
constexpr double kRotationFitScale_rad = 5e-3;  // flow that counts half in the rotation fit
constexpr double kEpipoleFloor = 1e-6;          // squared sine to the epipole under which a match says nothing
constexpr double kTiny = 1e-24;

/// Two unit vectors that span the plane normal to the unit vector v.
void tangent_basis(const Vec3& v, Vec3& e1, Vec3& e2) {
  e1 = std::fabs(v.x()) < 0.6 ? v.cross(Vec3::UnitX()) : v.cross(Vec3::UnitY());
  e1.normalize();
  e2 = v.cross(e1);
}

/// Squared sine of the angle between b2 and the epipolar plane, limited so that it is finite at the epipole.
double squared_distance(const Vec3& direction, const Vec3& derotated, const Vec3& normal) {
  const double e = direction.dot(normal);
  const double cosine = direction.dot(derotated);
  return e * e / std::fmax(1.0 - cosine * cosine, kEpipoleFloor);
}

}  // namespace

Quat TwoViewRansac::fit_rotation(std::span<const BearingMatch> matches) const {
  Quat q = Quat::Identity();
  for (int iteration = 0; iteration < kRotationIterations; ++iteration) {
    Mat3 information = Mat3::Identity() * kTiny;
    Vec3 gradient = Vec3::Zero();
    for (const BearingMatch& match : matches) {
      const Vec3 b = q * match.previous_C1;
      const Vec3 error = match.current_C2 - b;
      const double weight = 1.0 / (1.0 + error.squaredNorm() / (kRotationFitScale_rad * kRotationFitScale_rad));
      const Mat3 jacobian = -skew(b);  // Exp(d) b = b + d x b
      information += weight * jacobian.transpose() * jacobian;
      gradient += weight * jacobian.transpose() * error;
    }
    q = (so3_exp(information.ldlt().solve(gradient)) * q).normalized();
  }
  return q;
}

void TwoViewRansac::derotate(std::span<const BearingMatch> matches, const Quat& q_C2C1) {
  const Mat3 rotation = q_C2C1.toRotationMatrix();
  count_ = matches.size();
  for (std::size_t i = 0; i < count_; ++i) {
    derotated_[i] = rotation * matches[i].previous_C1;
    normal_[i] = derotated_[i].cross(matches[i].current_C2);
  }
}

// Truncated squared distance (MSAC): among hypotheses with equal support the tighter one wins.
double TwoViewRansac::cost_of(const Vec3& direction, double threshold_rad) const {
  const double limit = threshold_rad * threshold_rad;
  double cost = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    cost += std::fmin(squared_distance(direction, derotated_[i], normal_[i]), limit);
  }
  return cost;
}

void TwoViewRansac::search(double threshold_rad, Model& best) {
  best.cost = cost_of(best.direction, threshold_rad);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const std::uint32_t n = static_cast<std::uint32_t>(count_);
    const std::uint32_t i = generator_.below(n);
    const std::uint32_t j = (i + 1 + generator_.below(n - 1)) % n;
    const Vec3 direction = normal_[i].cross(normal_[j]);
    const double norm2 = direction.squaredNorm();
    if (!(norm2 > kTiny)) continue;
    const Vec3 unit = direction / std::sqrt(norm2);
    const double cost = cost_of(unit, threshold_rad);
    if (cost < best.cost) {
      best.cost = cost;
      best.direction = unit;
    }
  }
}

// Minimises sum rho(t . (Exp(d) b1' x b2) / |t x b1'|) + |d|^2 / sigma^2 over the small rotation d and the unit vector
// t.
void TwoViewRansac::refine(std::span<const BearingMatch> matches, const Quat& q_C2C1, double sigma_rad,
                           double scale_rad, Model& model) const {
  const double prior = (scale_rad / sigma_rad) * (scale_rad / sigma_rad);
  for (int iteration = 0; iteration < kRefineIterations; ++iteration) {
    const Mat3 rotation = (model.q_correction * q_C2C1).toRotationMatrix();
    Vec3 e1;
    Vec3 e2;
    tangent_basis(model.direction, e1, e2);
    Mat5 information = Mat5::Identity() * 1e-9;
    Vec5 gradient = Vec5::Zero();
    for (const BearingMatch& match : matches) {
      const Vec3 b1 = rotation * match.previous_C1;
      const Vec3 normal = b1.cross(match.current_C2);
      const double cosine = model.direction.dot(b1);
      const double inverse = 1.0 / std::sqrt(std::fmax(1.0 - cosine * cosine, kEpipoleFloor));
      const double error = model.direction.dot(normal) * inverse;
      const double weight = 1.0 / (1.0 + error * error / (scale_rad * scale_rad));
      // t . ((b1 + d x b1) x b2) = t . n + d . (b1 x (b2 x t))
      Vec5 jacobian;
      jacobian << b1.cross(match.current_C2.cross(model.direction)) * inverse, e1.dot(normal) * inverse,
          e2.dot(normal) * inverse;
      information.noalias() += weight * weight * jacobian * jacobian.transpose();
      gradient -= weight * weight * error * jacobian;
    }
    information.topLeftCorner<3, 3>().diagonal().array() += prior;
    gradient.head<3>() -= prior * so3_log(model.q_correction);
    const Vec5 step = information.ldlt().solve(gradient);
    if (!step.allFinite()) return;
    model.q_correction = (so3_exp(step.head<3>()) * model.q_correction).normalized();
    model.direction = (model.direction + step[3] * e1 + step[4] * e2).normalized();
  }
}

// A match is an outlier too when its point would lie behind the cameras: it moved against the direction in which most
// points move by more than the threshold.
void TwoViewRansac::judge(std::span<const BearingMatch> matches, Model& model, Outcome& out) const {
  const double limit = options_.threshold_rad * options_.threshold_rad;
  double forward = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    if (squared_distance(model.direction, derotated_[i], normal_[i]) > limit) continue;
    forward += (matches[i].current_C2 - derotated_[i]).dot(model.direction);
  }
  if (forward < 0.0) model.direction = -model.direction;
  out.inliers = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Vec3 flow = matches[i].current_C2 - derotated_[i];
    const Vec3 away = model.direction - model.direction.dot(derotated_[i]) * derotated_[i];
    const double advance = flow.dot(away);  // times |away|, which the limit below carries too
    const bool behind = advance < 0.0 && advance * advance > limit * away.squaredNorm();
    out.inlier[i] = !behind && squared_distance(model.direction, derotated_[i], normal_[i]) <= limit;
    if (out.inlier[i]) ++out.inliers;
  }
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

  const Quat q_given = q_C2C1 != nullptr ? q_C2C1->normalized() : fit_rotation(matches);
  const double sigma_rad = q_C2C1 != nullptr ? options_.rotation_sigma_rad : options_.blind_rotation_sigma_rad;
  const double wide_rad = options_.threshold_rad + options_.rotation_sigma_rad;
  Model model;
  derotate(matches, q_given);
  search(wide_rad, model);
  refine(matches, q_given, sigma_rad, options_.threshold_rad, model);
  const Quat q_refined = (model.q_correction * q_given).normalized();
  derotate(matches, q_refined);
  search(options_.threshold_rad, model);
  judge(matches, model, out);
  if (static_cast<double>(out.inliers) < kMinInlierShare * static_cast<double>(matches.size())) {
    out.inliers = matches.size();
    out.inlier.fill(true);
    return Status::kOk;
  }
  out.judged = true;
  out.q_C2C1 = q_refined;
  out.direction_C2 = model.direction;
  return Status::kOk;
}

}  // namespace plumb
