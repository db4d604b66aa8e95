#pragma once
// Pinhole camera with a lens. Maps between distorted pixels and the undistorted normalised plane z = 1 of frame C.

#include <array>
#include <cstdint>

#include "fsw/base/status.h"
#include "fsw/math/so3.h"

namespace plumb {

enum class Distortion : std::uint8_t {
  kNone = 0,
  kRadialTangential,  ///< k1, k2, p1, p2 (Brown-Conrady, as in OpenCV and the ASL format)
  kEquidistant,       ///< k1, k2, k3, k4 (Kannala-Brandt, as OpenCV's fisheye)
  kFov,               ///< w [rad] (Devernay-Faugeras)
};

struct CameraCalibration {
  std::int32_t width = 0;   ///< px
  std::int32_t height = 0;  ///< px
  double fx = 0.0;          ///< px
  double fy = 0.0;
  double cx = 0.0;  ///< px, pixel centres at integer coordinates
  double cy = 0.0;
  Distortion distortion = Distortion::kNone;
  std::array<double, 4> coefficients{};
};

class CameraModel {
 public:
  CameraModel() = default;
  /// Precondition of every later call: check(calibration) is kOk.
  explicit CameraModel(const CameraCalibration& calibration);

  /// kInvalidValue when focal lengths, size or coefficients are not finite or not positive where they must be.
  static Status check(const CameraCalibration& calibration);
  const CameraCalibration& calibration() const { return calibration_; }

  /// Normalised plane to distorted pixel. kInvalidValue where the lens model folds over or is undefined.
  [[nodiscard]] Status distort(const Vec2& normalised, Vec2& pixel) const;
  /// The same with the analytic Jacobian d pixel / d normalised [px].
  [[nodiscard]] Status distort(const Vec2& normalised, Vec2& pixel, Mat2& jacobian) const;
  /// Distorted pixel to normalised plane by a bounded Newton iteration. kIllConditioned when it does not converge,
  /// which is where no point of the plane is imaged; kInvalidValue when the pixel is not finite.
  [[nodiscard]] Status undistort(const Vec2& pixel, Vec2& normalised) const;
  /// Mean focal length [px]: converts pixel noise to the normalised plane.
  double focal_px() const { return 0.5 * (calibration_.fx + calibration_.fy); }

 private:
  CameraCalibration calibration_;
  double max_radius_ = 0.0;  ///< normalised radius up to which the radial model grows monotonically
};

}  // namespace plumb
