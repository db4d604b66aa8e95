#pragma once
// A small patch kept from the image in which a feature was first seen, and its alignment in later images. Following
// from image to image adds up errors; aligning with one and the same patch does not, so that a feature stands still
// when the camera does.
//
// Alignment is inverse compositional (Baker and Matthews 2004): the gradients are those of the patch and are computed
// once. Position and size are found together. Mean and gain are taken out of both sides, so that exposure changes do
// not matter.
//
// Cost: at most 12 iterations * 13 * 13 samples, each interpolated between four pixels and multiplied five times.

#include "fsw/base/status.h"
#include "fsw/math/so3.h"
#include "fsw/measurement/samples.h"
#include "fsw/vision/patch_samples.h"

namespace plumb {

struct PatchPosition {
  float u_px = 0.0F;
  float v_px = 0.0F;
  float scale = 1.0F;       ///< size of the patch in the image over its size when it was taken, beyond the given warp
  float similarity = 0.0F;  ///< zero-mean normalised cross-correlation, -1 to 1
};

class PatchTemplate {
 public:
  /// Takes the patch around a point. kRejected when it reaches out of the image, kIllConditioned when it has too little
  /// texture in some direction; the template is then as before.
  [[nodiscard]] Status capture(const ImageView& image, float u_px, float v_px);

  /// Finds the patch, starting at `position` and its scale; `warp` maps offsets from the centre in the patch to offsets
  /// in the image (both px). kRejected when it leaves the image or changes its size too much, kIllConditioned when it
  /// does not converge; `position` is then undefined.
  [[nodiscard]] Status align(const ImageView& image, const Mat2& warp, PatchPosition& position) const;

 private:
  PatchSamples value_{};       ///< grey level less the mean
  PatchSamples gradient_u_{};  ///< grey levels per px, less the mean
  PatchSamples gradient_v_{};
  PatchSamples gradient_s_{};                                     ///< grey levels per unit of scale, less the mean
  Eigen::Matrix3f inverse_tensor_ = Eigen::Matrix3f::Identity();  ///< of the three gradients
  Eigen::Vector3f slope_ = Eigen::Vector3f::Zero();               ///< of value_ along the three gradients
  float energy_ = 0.0F;                                           ///< sum of value_ squared
};

}  // namespace plumb
