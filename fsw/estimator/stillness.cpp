#include "fsw/estimator/stillness.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "fsw/math/exact.h"

namespace plumb {
namespace {

constexpr std::size_t kMinSamples = 10;
constexpr double kMaxTurnRate = 0.2;       // rad/s, mean: larger than any turn-on bias, smaller than a real turn
constexpr double kMaxGravityError = 0.05;  // of gravity: a steady acceleration is not standing still
constexpr double kOutlierRatio = 3.0;      // of the mean squared residual of the first fit
constexpr double kMinSpread = 1e-12;       // conditioning of the points, relative

using Affine = Eigen::Matrix<double, 3, 2>;

/// Least-squares affine field over the displacements whose squared residual under `previous` is below `limit`.
bool fit(const Displacement* d, std::size_t count, const Affine& previous, double limit, Affine& field) {
  Mat3 a = Mat3::Zero();
  Affine b = Affine::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 x = d[i].from.homogeneous();
    if ((d[i].by - previous.transpose() * x).squaredNorm() > limit) continue;
    a += x * x.transpose();
    b += x * d[i].by.transpose();
  }
  const Eigen::LDLT<Mat3> factor(a);
  if (!(factor.vectorD().minCoeff() > kMinSpread * a.trace())) return false;
  field = factor.solve(b);
  return true;
}

}  // namespace

bool imu_is_still(const ImuBuffer& imu, Time from, Time to, const EstimatorOptions& options) {
  if (!imu.spans(from, to)) return false;
  const ImuStatistics s = imu.statistics(from, to);
  if (s.count < kMinSamples) return false;
  const double root_rate = std::sqrt(static_cast<double>(s.count) / (to - from).seconds());
  const auto limit = [root_rate](double still, double noise_density) {  // the noise of three axes adds to the motion
    return exact::hypot(still, std::sqrt(3.0) * noise_density * root_rate);
  };
  const double gravity_m_s2 = options.imu.gravity_m_s2;
  return s.gyro_deviation_rad_s < limit(options.start.still_gyro_rad_s, options.imu.gyro_noise_density) &&
         s.accel_deviation_m_s2 < limit(options.start.still_accel_m_s2, options.imu.accel_noise_density) &&
         s.mean_gyro_rad_s.norm() < kMaxTurnRate &&
         std::abs(s.mean_accel_m_s2.norm() - gravity_m_s2) < kMaxGravityError * gravity_m_s2;
}

double smooth_flow_rms(const Displacement* displacements, std::size_t count, const Vec2& half_size) {
  constexpr double kUndetermined = std::numeric_limits<double>::infinity();
  Affine field;
  if (!fit(displacements, count, Affine::Zero(), kUndetermined, field)) return kUndetermined;
  double residual = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    residual += (displacements[i].by - field.transpose() * displacements[i].from.homogeneous()).squaredNorm();
  }
  const double limit = kOutlierRatio * residual / static_cast<double>(count);
  const Affine first = field;
  if (limit > 0.0 && !fit(displacements, count, first, limit, field)) return kUndetermined;
  // Of x, y and 1 over the image.
  const Vec3 mean_square(half_size.x() * half_size.x() / 3.0, half_size.y() * half_size.y() / 3.0, 1.0);
  return std::sqrt(mean_square.dot(field.rowwise().squaredNorm()));
}

}  // namespace plumb
