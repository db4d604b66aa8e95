#include "fsw/vision/camera_model.h"

#include <cmath>
#include <numbers>

#include "fsw/math/exact.h"

namespace plumb {
namespace {

constexpr int kMaxNewtonIterations = 20;     // 4 to 6 are used on real lenses; the rest is for the image corners
constexpr double kNewtonStep = 1e-13;        // normalised plane: far below a rounding of the pixel coordinates
constexpr int kFoldScanSteps = 1024;         // 1.5 mrad of field angle each
constexpr double kMaxFieldAngle_rad = 1.55;  // beyond it the plane z = 1 says nothing (radius 48)
constexpr double kSeriesLimit = 1e-2;        // argument below which atan(a)/a is summed; 4 terms are exact to 1e-16
constexpr double kMaxFov_rad = 3.1;          // tan(w/2) stays finite

using Coefficients = std::array<double, 4>;

// A radial lens maps x to factor * x. slope is (d factor / d r) / r, which is finite at r = 0, and so the Jacobian is
// factor * I + slope * x x^T with no special case at the centre.
struct Radial {
  double factor = 1.0;
  double slope = 0.0;
};

Radial radial_polynomial(const Coefficients& k, double r2) {
  return {1.0 + r2 * (k[0] + r2 * k[1]), 2.0 * k[0] + 4.0 * k[1] * r2};
}

// atan(a) / a and ((1 / (1 + a^2)) - atan(a) / a) / a^2 with q = a^2.
Radial arctangent_ratio(double q) {
  if (q < kSeriesLimit * kSeriesLimit) {
    return {1.0 - q * (1.0 / 3.0 - q * (1.0 / 5.0 - q / 7.0)), -2.0 / 3.0 + q * (4.0 / 5.0 - q * 6.0 / 7.0)};
  }
  const double a = std::sqrt(q);
  const double ratio = exact::atan(a) / a;
  return {ratio, (1.0 / (1.0 + q) - ratio) / q};
}

Radial radial_equidistant(const Coefficients& k, double r2) {
  const Radial angle = arctangent_ratio(r2);  // theta / r
  const double theta2 = angle.factor * angle.factor * r2;
  const double gain = 1.0 + theta2 * (k[0] + theta2 * (k[1] + theta2 * (k[2] + theta2 * k[3])));
  // (d gain / d r) / r = (d gain / d theta) / theta * (theta / r) * (d theta / d r)
  const double gain_by_theta = 2.0 * k[0] + theta2 * (4.0 * k[1] + theta2 * (6.0 * k[2] + theta2 * 8.0 * k[3]));
  const double gain_slope = gain_by_theta * angle.factor / (1.0 + r2);
  return {angle.factor * gain, angle.slope * gain + angle.factor * gain_slope};
}

Radial radial_fov(const Coefficients& k, double r2) {
  const double w = k[0];
  const double a = 2.0 * exact::tan(0.5 * w);
  const Radial angle = arctangent_ratio(a * a * r2);
  return {angle.factor * a / w, angle.slope * a * a * a / w};
}

Radial radial(const CameraCalibration& calibration, double r2) {
  switch (calibration.distortion) {
    case Distortion::kNone: return {};
    case Distortion::kRadialTangential: return radial_polynomial(calibration.coefficients, r2);
    case Distortion::kEquidistant: return radial_equidistant(calibration.coefficients, r2);
    case Distortion::kFov: return radial_fov(calibration.coefficients, r2);
  }
  return {};
}

/// Lens alone: normalised plane to distorted normalised plane.
void apply_lens(const CameraCalibration& calibration, const Vec2& n, Vec2& distorted, Mat2& jacobian) {
  const Radial lens = radial(calibration, n.squaredNorm());
  distorted = lens.factor * n;
  jacobian = lens.factor * Mat2::Identity() + lens.slope * n * n.transpose();
  if (calibration.distortion != Distortion::kRadialTangential) return;
  const double p1 = calibration.coefficients[2];
  const double p2 = calibration.coefficients[3];
  const double x = n.x();
  const double y = n.y();
  distorted.x() += 2.0 * p1 * x * y + p2 * (3.0 * x * x + y * y);
  distorted.y() += p1 * (x * x + 3.0 * y * y) + 2.0 * p2 * x * y;
  jacobian(0, 0) += 2.0 * p1 * y + 6.0 * p2 * x;
  jacobian(0, 1) += 2.0 * p1 * x + 2.0 * p2 * y;
  jacobian(1, 0) += 2.0 * p1 * x + 2.0 * p2 * y;
  jacobian(1, 1) += 6.0 * p1 * y + 2.0 * p2 * x;
}

/// The radius just inside the first fold of the radial model. The scan goes outward from the axis: beyond a fold the
/// derivative may turn positive again, so that looking at one radius alone cannot tell.
double first_fold_radius(const CameraCalibration& calibration) {
  double last = 0.0;
  for (int i = 1; i <= kFoldScanSteps; ++i) {
    const double r = exact::tan(kMaxFieldAngle_rad * i / kFoldScanSteps);
    const Radial lens = radial(calibration, r * r);
    if (!(lens.factor + lens.slope * r * r > 0.0)) break;
    last = r;
  }
  return last;
}

Status undistort_newton(const CameraCalibration& calibration, double max_radius, const Vec2& distorted, Vec2& n) {
  n = distorted;
  for (int i = 0; i < kMaxNewtonIterations; ++i) {
    const double radius = n.norm();
    if (radius > max_radius) n *= max_radius / radius;
    Vec2 image;
    Mat2 jacobian;
    apply_lens(calibration, n, image, jacobian);
    const double determinant = jacobian.determinant();
    if (!(determinant > 0.0)) return Status::kIllConditioned;
    const Vec2 error = distorted - image;
    const Vec2 step = Vec2(jacobian(1, 1) * error.x() - jacobian(0, 1) * error.y(),
                           jacobian(0, 0) * error.y() - jacobian(1, 0) * error.x()) /
                      determinant;
    n += step;
    if (step.squaredNorm() < kNewtonStep * kNewtonStep * (1.0 + n.squaredNorm())) {
      return n.norm() <= max_radius ? Status::kOk : Status::kIllConditioned;
    }
  }
  return Status::kIllConditioned;
}

// In the field angle the equidistant polynomial is nearly linear, while the tangent of the angle would defeat Newton
// near 90 degrees.
Status undistort_equidistant(const Coefficients& k, double max_radius, const Vec2& distorted, Vec2& n) {
  const double theta_d = distorted.norm();
  const double max_theta = exact::atan(max_radius);
  double theta = std::fmin(theta_d, max_theta);
  for (int i = 0; i < kMaxNewtonIterations; ++i) {
    const double t2 = theta * theta;
    const double value = theta * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
    const double slope = 1.0 + t2 * (3.0 * k[0] + t2 * (5.0 * k[1] + t2 * (7.0 * k[2] + t2 * 9.0 * k[3])));
    if (!(slope > 0.0)) return Status::kIllConditioned;
    const double step = (theta_d - value) / slope;
    theta += step;
    if (std::fabs(step) < kNewtonStep) {
      if (theta > max_theta) return Status::kIllConditioned;
      n = theta_d < kSeriesLimit * kNewtonStep ? distorted : Vec2(distorted * (exact::tan(theta) / theta_d));
      return Status::kOk;
    }
    theta = std::fmin(std::fmax(theta, 0.0), max_theta);
  }
  return Status::kIllConditioned;
}

Status undistort_fov(const Coefficients& k, double max_radius, const Vec2& distorted, Vec2& n) {
  const double w = k[0];
  const double angle = distorted.norm() * w;
  if (!(angle < 0.5 * std::numbers::pi)) return Status::kIllConditioned;
  const double q = angle * angle;
  // tan(a) / a; its limit 1 leaves the factor w / (2 tan(w / 2)) at the centre.
  const double ratio = angle < kSeriesLimit
                           ? 1.0 + q * (1.0 / 3.0 + q * (2.0 / 15.0 + q * (17.0 / 315.0 + q * 62.0 / 2835.0)))
                           : exact::tan(angle) / angle;
  n = distorted * (ratio * w / (2.0 * exact::tan(0.5 * w)));
  return n.norm() <= max_radius ? Status::kOk : Status::kIllConditioned;
}

}  // namespace

CameraModel::CameraModel(const CameraCalibration& calibration)
    : calibration_(calibration), max_radius_(first_fold_radius(calibration)) {}

Status CameraModel::check(const CameraCalibration& calibration) {
  if (calibration.width <= 0 || calibration.height <= 0) return Status::kInvalidValue;
  if (!(std::isfinite(calibration.fx) && calibration.fx > 0.0)) return Status::kInvalidValue;
  if (!(std::isfinite(calibration.fy) && calibration.fy > 0.0)) return Status::kInvalidValue;
  if (!std::isfinite(calibration.cx) || !std::isfinite(calibration.cy)) return Status::kInvalidValue;
  for (const double coefficient : calibration.coefficients) {
    if (!std::isfinite(coefficient)) return Status::kInvalidValue;
  }
  switch (calibration.distortion) {
    case Distortion::kNone:
    case Distortion::kRadialTangential:
    case Distortion::kEquidistant: return Status::kOk;
    case Distortion::kFov: {
      const double w = calibration.coefficients[0];
      return w > 0.0 && w < kMaxFov_rad ? Status::kOk : Status::kInvalidValue;
    }
  }
  return Status::kInvalidValue;
}

Status CameraModel::distort(const Vec2& normalised, Vec2& pixel) const {
  Mat2 jacobian;
  return distort(normalised, pixel, jacobian);
}

Status CameraModel::distort(const Vec2& normalised, Vec2& pixel, Mat2& jacobian) const {
  const double r2 = normalised.squaredNorm();
  if (!(r2 <= max_radius_ * max_radius_)) return Status::kInvalidValue;  // also refuses what is not a number
  Vec2 distorted;
  apply_lens(calibration_, normalised, distorted, jacobian);
  if (!(jacobian.determinant() > 0.0)) return Status::kInvalidValue;  // the tangential terms can fold it earlier
  const Vec2 focal(calibration_.fx, calibration_.fy);
  pixel = focal.cwiseProduct(distorted) + Vec2(calibration_.cx, calibration_.cy);
  jacobian = focal.asDiagonal() * jacobian;
  return Status::kOk;
}

Status CameraModel::undistort(const Vec2& pixel, Vec2& normalised) const {
  if (!pixel.allFinite()) return Status::kInvalidValue;
  const Vec2 distorted((pixel.x() - calibration_.cx) / calibration_.fx,
                       (pixel.y() - calibration_.cy) / calibration_.fy);
  switch (calibration_.distortion) {
    case Distortion::kNone: normalised = distorted; return Status::kOk;
    case Distortion::kRadialTangential: return undistort_newton(calibration_, max_radius_, distorted, normalised);
    case Distortion::kEquidistant:
      return undistort_equidistant(calibration_.coefficients, max_radius_, distorted, normalised);
    case Distortion::kFov: return undistort_fov(calibration_.coefficients, max_radius_, distorted, normalised);
  }
  return Status::kInvalidValue;
}

}  // namespace plumb
