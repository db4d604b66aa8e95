#pragma once
// Implementation of filter_state.h.

namespace plumb {

template <class Config>
bool FilterState<Config>::reanchor(SlamFeature& feature, std::size_t index, std::size_t slot) {
  Reanchoring r;
  if (!ok(reanchor_feature(pose(feature.anchor_slot).camera, pose(slot).camera, feature.parameters, r))) return false;
  double storage[kFeatureSize * Layout::kSize] = {};
  MatrixView jacobian(storage, kFeatureSize, size(), Layout::kSize);
  jacobian.fixed<3, 6>(0, Layout::pose(feature.anchor_slot)) = r.by_from;
  jacobian.fixed<3, 6>(0, Layout::pose(slot)) = r.by_to;
  jacobian.fixed<3, 3>(0, Layout::feature(index)) = r.by_feature;
  Support support;
  static_cast<void>(support.push_back({Layout::pose(feature.anchor_slot), kPoseSize}));
  static_cast<void>(support.push_back({Layout::pose(slot), kPoseSize}));
  static_cast<void>(support.push_back({Layout::feature(index), kFeatureSize}));
  assign_linear(covariance(), Layout::feature(index), jacobian, support, Mat3::Zero());
  feature.parameters = r.feature;
  feature.anchor_slot = slot;
  return true;
}

template <class Config>
void FilterState<Config>::drop_pose(std::size_t i) {
  const std::size_t leaving = window_[i];
  const std::size_t heir = i + 1 == window_.size() ? (i == 0 ? leaving : window_[i - 1]) : window_.back();
  for (std::size_t f = features.size(); f-- > 0;) {  // backwards: removal moves the last feature down
    if (features[f].anchor_slot != leaving) continue;
    if (heir == leaving || !reanchor(features[f], f, heir)) remove_feature(f);
  }
  clear_block(covariance(), Layout::pose(leaving), kPoseSize);
  window_.erase(i);
}

template <class Config>
void FilterState<Config>::clone_camera(std::uint32_t sequence, const Vec3& rate_I_rad_s) {
  bool used[Config::kMaxPoses] = {};
  for (std::size_t slot : window_) used[slot] = true;
  std::size_t slot = 0;
  while (slot < Config::kMaxPoses && used[slot]) ++slot;
  PLUMB_ASSERT(slot < Config::kMaxPoses);

  WindowPose& added = poses_[slot];
  added.sequence = sequence;
  added.q_WC = (core.motion.q_WI * calibration_.sensors().q_IC).normalized();
  added.camera.R_WC = added.q_WC.toRotationMatrix();
  added.camera.p_WC_m = core.motion.p_WI_m + core.motion.q_WI * calibration_.sensors().p_IC_m;
  static_assert(kXiP == kTheta + 3, "a clone copies theta and xi_p as one block");
  clone_block(covariance(), kTheta, Layout::pose(slot), kPoseSize);
  if (estimates_camera()) {
    const Mat67 by_mount = calibration_.camera_by_mount(core.motion, rate_I_rad_s);
    add_linear(covariance(), Layout::pose(slot),
               ConstMatrixView(by_mount.data(), kPoseSize, kCameraMountSize, kCameraMountSize), Layout::kCameraMount);
  }
  static_cast<void>(window_.push_back(slot));
}

template <class Config>
void FilterState<Config>::set_calibration(const SensorCalibration& file, const CalibrationOptions& sigmas) {
  calibration_ = CalibrationState(file);
  estimated_ = {};
  clear_block(covariance(), kCoreSize, Layout::kCalibrationSize);
  core.gyro_scale = core.accel_scale = Vec3::Zero();
  const auto set = [this](bool room, std::size_t at, std::size_t count, double sigma) {
    if (!room || sigma == 0.0) return;
    for (std::size_t i = at; i < at + count; ++i) {
      covariance()(i, i) = sigma * sigma;
      estimated_[i - kCoreSize] = true;
    }
  };
  const CalibrationBlocks room = Layout::kBlocks;
  set(room.imu_scale, Layout::kImuScale, 3, sigmas.gyro_scale_sigma);
  set(room.imu_scale, Layout::kImuScale + 3, 3, sigmas.accel_scale_sigma);
  set(room.camera, Layout::kCameraMount, 1, sigmas.time_offset_sigma_s);
  set(room.camera, Layout::kCameraMount + 1, 3, sigmas.camera_rotation_sigma_rad);
  set(room.camera, Layout::kCameraMount + 4, 3, sigmas.camera_position_sigma_m);
  set(room.range_finder, Layout::kBeam, 2, sigmas.beam_tilt_sigma_rad);
  set(room.range_finder, Layout::kBeam + 2, 3, sigmas.beam_origin_sigma_m);
}

template <class Config>
CalibrationReport FilterState<Config>::calibration_report() const {
  static_assert(CalibrationReport::kSize == kImuScaleSize + kCameraMountSize + kBeamSize);
  CalibrationReport report;
  Eigen::Map<Vec3>(report.value.data()) = core.gyro_scale;
  Eigen::Map<Vec3>(report.value.data() + 3) = core.accel_scale;
  const auto mounts = calibration_.difference_from_file();
  std::copy(mounts.begin(), mounts.end(), report.value.begin() + kImuScaleSize);
  const ConstMatrixView p = covariance();
  const auto sigmas = [&](bool room, std::size_t at, std::size_t count, std::size_t to) {
    for (std::size_t i = 0; room && i < count; ++i) report.sigma[to + i] = std::sqrt(std::max(p(at + i, at + i), 0.0));
  };
  const CalibrationBlocks room = Layout::kBlocks;
  sigmas(room.imu_scale, Layout::kImuScale, kImuScaleSize, 0);
  sigmas(room.camera, Layout::kCameraMount, kCameraMountSize, kImuScaleSize);
  sigmas(room.range_finder, Layout::kBeam, kBeamSize, kImuScaleSize + kCameraMountSize);
  return report;
}

template <class Config>
Status FilterState<Config>::add_feature(const SlamFeature& feature, const Mat3& covariance_block) {
  if (!ok(features.push_back(feature))) return Status::kFull;
  const std::size_t at = Layout::feature(features.size() - 1);
  clear_block(covariance(), at, kFeatureSize);
  covariance().template fixed<3, 3>(at, at) = covariance_block;
  return Status::kOk;
}

template <class Config>
Status FilterState<Config>::add_feature(const SlamFeature& feature, ConstMatrixView jacobian, const Support& support,
                                        const Mat3& noise) {
  if (!ok(add_feature(feature, Mat3::Zero()))) return Status::kFull;
  assign_linear(covariance(), Layout::feature(features.size() - 1), jacobian, support, noise);
  return Status::kOk;
}

template <class Config>
void FilterState<Config>::remove_feature(std::size_t i) {
  const std::size_t last = features.size() - 1;
  if (i != last) {
    move_block(covariance(), Layout::feature(last), Layout::feature(i), kFeatureSize);
    features[i] = features[last];
  }
  features.pop_back();
}

template <class Config>
void FilterState<Config>::begin_world_here(double sigma_m) {
  PLUMB_ASSERT(window_.empty() && features.empty());
  core.motion.p_WI_m.setZero();
  MatrixView p = covariance();
  clear_block(p, kXiP, 3);
  for (std::size_t k = kXiP; k < kXiP + 3; ++k) p(k, k) = sigma_m * sigma_m;
}

template <class Config>
void FilterState<Config>::turn_world(double yaw_rad, double sigma_rad) {
  const Quat turn = so3_exp(Vec3(0.0, 0.0, yaw_rad));
  core.motion.q_WI = (turn * core.motion.q_WI).normalized();
  core.motion.p_WI_m = turn * core.motion.p_WI_m;
  core.motion.v_WI_m_s = turn * core.motion.v_WI_m_s;
  for (std::size_t slot : window_) {
    WindowPose& pose = poses_[slot];
    pose.q_WC = (turn * pose.q_WC).normalized();
    pose.camera.p_WC_m = turn * pose.camera.p_WC_m;
    pose.camera.R_WC = pose.q_WC.toRotationMatrix();
  }
  const Mat3 rotation = turn.toRotationMatrix();
  MatrixView p = covariance();
  const auto turn_vector = [&](std::size_t at) { rotate_block(p, at, rotation); };
  for (const std::size_t at : {kTheta, kXiP, kXiV}) turn_vector(at);
  for (std::size_t slot : window_) {
    turn_vector(Layout::pose(slot));
    turn_vector(Layout::pose(slot) + 3);
  }
  const auto uncertain = [&](std::size_t a, std::size_t b) { p(a, b) += sigma_rad * sigma_rad; };
  constexpr std::size_t kHeading = 2;  // of a rotation error in W
  uncertain(kTheta + kHeading, kTheta + kHeading);
  for (std::size_t slot : window_) {
    const std::size_t at = Layout::pose(slot) + kHeading;
    uncertain(at, kTheta + kHeading);
    uncertain(kTheta + kHeading, at);
    for (std::size_t other : window_) uncertain(at, Layout::pose(other) + kHeading);
  }
}

template <class Config>
void FilterState<Config>::retract(const double* dx) {
  retract_core(core, dx);
  if (estimates_scale()) {
    core.gyro_scale += Vec3(dx + Layout::kImuScale);
    core.accel_scale += Vec3(dx + Layout::kImuScale + 3);
  }
  if (estimates_camera()) calibration_.retract_camera(dx + Layout::kCameraMount);
  if (estimates_beam()) calibration_.retract_beam(dx + Layout::kBeam);
  for (std::size_t slot : window_) {
    WindowPose& pose = poses_[slot];
    const double* error = dx + Layout::pose(slot);
    retract_pose(Vec3(error), Vec3(error + 3), pose.q_WC, pose.camera.p_WC_m);
    pose.camera.R_WC = pose.q_WC.toRotationMatrix();
  }
  for (std::size_t i = 0; i < features.size(); ++i) features[i].parameters += Vec3(dx + Layout::feature(i));
}

template <class Config>
bool FilterState<Config>::healthy() const {
  const ConstMatrixView p = covariance();
  const auto good = [&p](std::size_t i) { return p(i, i) > 0.0 && std::isfinite(p(i, i)); };
  bool all = core.motion.q_WI.coeffs().allFinite() && core.motion.p_WI_m.allFinite() &&
             core.motion.v_WI_m_s.allFinite() && core.b_gyro_rad_s.allFinite() && core.b_accel_m_s2.allFinite();
  for (std::size_t i = 0; i < kCoreSize; ++i) all = all && good(i);
  all = all && calibration_.finite() && core.gyro_scale.allFinite() && core.accel_scale.allFinite();
  for (std::size_t i = 0; i < Layout::kCalibrationSize; ++i) all = all && (!estimated_[i] || good(kCoreSize + i));
  for (std::size_t slot : window_) {
    for (std::size_t i = 0; i < kPoseSize; ++i) all = all && good(Layout::pose(slot) + i);
  }
  for (std::size_t f = 0; f < features.size(); ++f) {
    all = all && features[f].parameters.allFinite();
    for (std::size_t i = 0; i < kFeatureSize; ++i) all = all && good(Layout::feature(f) + i);
  }
  return all;
}

template <class Config>
std::uint64_t FilterState<Config>::hash() const {
  Hash64 h;
  h.add(static_cast<std::uint64_t>(t.ns()));
  h.add(core.motion.q_WI.coeffs().data(), 4);
  h.add(core.motion.p_WI_m.data(), 3);
  h.add(core.motion.v_WI_m_s.data(), 3);
  h.add(core.b_gyro_rad_s.data(), 3);
  h.add(core.b_accel_m_s2.data(), 3);
  for (std::size_t slot : window_) {
    h.add(std::uint64_t{slot});
    h.add(std::uint64_t{poses_[slot].sequence});
    h.add(poses_[slot].q_WC.coeffs().data(), 4);
    h.add(poses_[slot].camera.p_WC_m.data(), 3);
  }
  for (const SlamFeature& feature : features) {
    h.add(std::uint64_t{feature.track_id});
    h.add(std::uint64_t{feature.anchor_slot});
    h.add(feature.parameters.data(), 3);
  }
  const ConstMatrixView p = covariance();
  if constexpr (Layout::kCalibrationSize == 0) {
    for (std::size_t r = 0; r < p.rows(); ++r) h.add(p.row(r), p.cols());
    return h.value();
  }
  // What is not estimated has no say: the hash is that of a filter without room for it.
  const auto counts = [this](std::size_t i) {
    return i < kCoreSize || i >= Layout::kPoses || estimated_[i - kCoreSize];
  };
  for (std::size_t r = 0; r < p.rows(); ++r) {
    for (std::size_t c = 0; counts(r) && c < p.cols(); ++c) {
      if (counts(c)) h.add(p(r, c));
    }
  }
  const CalibrationReport report = calibration_report();
  for (std::size_t i = 0; i < CalibrationReport::kSize; ++i) {
    if (report.sigma[i] > 0.0) h.add(report.value[i]);
  }
  return h.value();
}

}  // namespace plumb
