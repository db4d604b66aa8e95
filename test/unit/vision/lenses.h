#pragma once
// Real lenses for the tests of this folder.

#include "fsw/vision/camera_model.h"

namespace plumb::test {

/// EuRoC, left camera.
inline CameraCalibration euroc_lens() {
  return {752,
          480,
          458.654,
          457.296,
          367.215,
          248.375,
          Distortion::kRadialTangential,
          {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}};
}
/// TUM VI's lens before a VGA imager: about 150 degrees along the diagonal.
inline CameraCalibration fisheye_lens() {
  return {640,
          480,
          300.0,
          300.0,
          319.3,
          241.4,
          Distortion::kEquidistant,
          {0.0034823894, 0.0007150348, -0.0020532361, 0.00020293673}};
}
/// The reference implementation's default.
inline CameraCalibration fov_lens() {
  return {752, 480, 349.778, 348.598, 375.866, 219.881, Distortion::kFov, {0.950711, 0.0, 0.0, 0.0}};
}
inline CameraCalibration no_lens() { return {640, 480, 320.0, 322.0, 319.5, 239.5, Distortion::kNone, {}}; }

}  // namespace plumb::test
