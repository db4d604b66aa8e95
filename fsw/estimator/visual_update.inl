#pragma once
// Implementation of visual_update.h.

namespace plumb {

template <class Config>
VisualUpdate<Config>::VisualUpdate(const VisionOptions& options, const SensorCalibration& calibration, int max_ranged)
    : focal_px_(calibration.focal_px), noise_(options), spread_(options, calibration), gate_(options.gate_probability) {
  use(options, max_ranged);
}

template <class Config>
void VisualUpdate<Config>::use(const VisionOptions& options, int max_ranged) {
  options_ = options;
  max_ranged_ = static_cast<std::size_t>(max_ranged);
  noise_.use(options);
  spread_.use(options);
  if (options.gate_probability != gate_.probability()) gate_ = ChiSquareTable(options.gate_probability);
  limits_.min_parallax = options.min_parallax_px / focal_px_;
  ranged_min_parallax_ = options.ranged_min_parallax_px / focal_px_;
  limits_.max_depth_m = options.max_depth_m;
  set_sigma();
}

template <class Config>
void VisualUpdate<Config>::set_sigma() {
  constexpr double kMaxResidualSigmas = 3.0;
  sigma_ = noise_.sigma_px() / focal_px_;
  limits_.max_rms = kMaxResidualSigmas * sigma_;
}

template <class Config>
Status VisualUpdate<Config>::run(State& state, Table& tracks, UpdateStack<Config>& stack, const DepthPrior& prior,
                                 const ScaleEvidence& scale, FrameReport& report, StageObserver* observer) {
  {
    StageScope scope(observer, Stage::kVisualRows);
    noise_.begin_image();
    remove_lost(state, tracks);
    spread_.clear(1.0 / prior.rho);
    for (const SlamFeature& feature : state.features) spread_.add(tracks.find(feature.track_id)->samples.back().z);
    stack.begin(state);
    add_slam_rows(state, tracks, stack, report);
    add_tracks(state, tracks, scale.excited, report);
    add_compressed_rows(state, stack);
  }
  StageScope scope(observer, Stage::kVisualUpdate);
  if (!ok(stack.apply(state))) return Status::kNumericalFault;
  start_ranged(state, tracks, report);
  const bool can_wait = scale.ranges_to_come || report.ranged_used > 0;
  if (!can_wait || scale_known(state)) {
    insert_pending(state, tracks, stack.correction(), report);
    start_without_parallax(state, tracks, prior, report);
  }
  tracks.drop_ended();
  report.slam_features = static_cast<std::uint32_t>(state.features.size());
  return Status::kOk;
}

template <class Config>
bool VisualUpdate<Config>::scale_known(const State& state) const {
  constexpr double kSlow_m_s = 0.5;  // below it what counts is the velocity itself
  const ConstMatrixView p = state.covariance();
  const double variance = p(kXiV, kXiV) + p(kXiV + 1, kXiV + 1) + p(kXiV + 2, kXiV + 2);
  const double speed = std::max(state.core.motion.v_WI_m_s.norm(), kSlow_m_s);
  return std::sqrt(variance) <= options_.slam_velocity_sigma * speed;
}

template <class Config>
void VisualUpdate<Config>::remove_lost(State& state, Table& tracks) {
  constexpr int kMaxRangesMissed = 1;   // one may be a false echo; then the one that the feature started from was
  constexpr double kMostAlone_s = 1.0;  // the range may be of the other side of an edge, and only ranges could tell
  for (TrackType& track : tracks.tracks()) track.in_state = false;
  for (std::size_t i = state.features.size(); i-- > 0;) {
    const SlamFeature& feature = state.features[i];
    TrackType* track = tracks.find(feature.track_id);
    const bool outlier = feature.consecutive_rejections > options_.max_rejections;
    const bool alone = feature.t_range != Time::never() && (state.t - feature.t_range).seconds() > kMostAlone_s;
    const bool misranged = alone || feature.ranges_missed > kMaxRangesMissed;  // the track may start anew
    if (track != nullptr && (outlier || misranged)) {
      track->banned = outlier;
      track->use_up();
    }
    if (outlier || misranged || track == nullptr || !track->alive) {
      state.remove_feature(i);
    } else {
      track->in_state = true;
    }
  }
}

template <class Config>
void VisualUpdate<Config>::add_slam_rows(State& state, Table& tracks, UpdateStack<Config>& stack, FrameReport& report) {
  const std::size_t here = state.window().back();
  for (std::size_t i = 0; i < state.features.size(); ++i) {
    SlamFeature& feature = state.features[i];
    TrackType* track = tracks.find(feature.track_id);
    const Vec2 seen = track->samples.back().z;
    track->use_up();  // every observation is used once
    VisualPrediction prediction;
    bool accepted = ok(predict_feature(state.pose(here).camera, state.pose(feature.anchor_slot).camera,
                                       feature.parameters, prediction));
    if (accepted) {
      MatrixView h = stack.open(2);
      Support support;
      if (here != feature.anchor_slot) {
        h.fixed<2, 6>(0, Layout::pose(here)) = prediction.by_pose / sigma_;
        h.fixed<2, 6>(0, Layout::pose(feature.anchor_slot)) = -prediction.by_pose / sigma_;
        static_cast<void>(support.push_back({Layout::pose(here), kPoseSize}));
        static_cast<void>(support.push_back({Layout::pose(feature.anchor_slot), kPoseSize}));
      }
      h.fixed<2, 3>(0, Layout::feature(i)) = prediction.by_feature / sigma_;
      static_cast<void>(support.push_back({Layout::feature(i), kFeatureSize}));
      const Vec2 residual = (seen - prediction.z) / sigma_;
      stack.residual(0) = residual.x();
      stack.residual(1) = residual.y();
      const double nis = stack.close(state, support);
      noise_.add(nis);
      report.slam_nis += nis;
      accepted = nis <= gate_.quantile(2);
      if (accepted) {
        stack.weaken(2, gate_.cost(2));
      } else {
        stack.discard(2);
      }
    }
    feature.consecutive_rejections = accepted ? 0 : feature.consecutive_rejections + 1;
    ++(accepted ? report.slam_used : report.slam_rejected);
  }
}

template <class Config>
Views VisualUpdate<Config>::views_of(const State& state, const TrackType& track) const {
  Views views;
  for (const TrackSample& sample : track.samples) {
    const std::size_t slot = state.slot_of(sample.sequence);
    if (slot == Config::kMaxPoses) continue;  // its pose has left the window
    static_cast<void>(views.push_back({state.pose(slot).camera, sample.z, slot}));
  }
  return views;
}

/// The range of a track and the view it belongs to; nothing when that view has left the window.
template <class Config>
std::optional<KnownDepth> VisualUpdate<Config>::known_depth(const State& state, const TrackType& track,
                                                            const Views& views) const {
  if (!track.range) return std::nullopt;
  const TrackRange& range = *track.range;
  const std::size_t slot = state.slot_of(range.sequence);
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (views[i].pose_slot != slot) continue;
    KnownDepth known{i, range.rho_1_m, range.sigma_1_m, sigma_ / range.sigma_1_m};
    if (range.ray) state.calibration().correct(*range.ray, known);
    return known;
  }
  return std::nullopt;
}

template <class Config>
bool VisualUpdate<Config>::determined(const State& state, const TrackType& track) const {
  const Views views = views_of(state, track);
  if (views.size() < static_cast<std::size_t>(options_.min_track_length)) return false;
  const bool ranged = known_depth(state, track, views).has_value();
  return parallax(views, views.size() - 1) >= (ranged ? ranged_min_parallax_ : limits_.min_parallax);
}

template <class Config>
std::size_t VisualUpdate<Config>::ranged_places(const State& state) const {
  const auto is_ranged = [](const auto& f) { return f.ranged; };
  const auto ranged = std::count_if(state.features.begin(), state.features.end(), is_ranged) +
                      std::count_if(pending_.begin(), pending_.begin() + pending_count_, is_ranged);
  return max_ranged_ - std::min(static_cast<std::size_t>(ranged), max_ranged_);
}

template <class Config>
typename VisualUpdate<Config>::TrackType* VisualUpdate<Config>::next_start(const State& state, Table& tracks) const {
  if (state.features.size() + pending_count_ >= Config::kMaxSlamFeatures || pending_count_ >= kMaxStarts)
    return nullptr;
  const auto can_start = [&](const TrackType& t) {
    return t.alive && full(t) && !waits_for_laser(t) && determined(state, t);
  };
  if (ranged_places(state) > 0) {
    TrackType* best = best_for_start(tracks, [&](const TrackType& t) { return t.range && can_start(t); });
    if (best != nullptr) return best;
  }
  return best_for_start(tracks, [&](const TrackType& t) { return !t.range && can_start(t); });
}

template <class Config>
void VisualUpdate<Config>::add_tracks(State& state, Table& tracks, bool excited, FrameReport& report) {
  pending_count_ = 0;
  compressed_.clear();
  std::size_t budget = Config::kMaxMsckfPerFrame;

  // Those that may become features come first: as many as there are free places.
  for (std::size_t tries = 0; tries < 2 * kMaxStarts && budget > 0; ++tries) {
    TrackType* track = next_start(state, tracks);
    if (track == nullptr) break;
    use_track(state, *track, true, report);
    --budget;
  }
  // Then the long and the ended, longest first.
  for (std::size_t length = Config::kMaxPoses; length >= static_cast<std::size_t>(options_.min_track_length);
       --length) {
    for (TrackType& track : tracks.tracks()) {
      if (budget == 0) return;
      if (track.in_state || track.banned || track.samples.size() != length) continue;
      const bool in_time = full(track) || (excited && early(state, track));
      if (track.alive && (!in_time || waits_for_laser(track))) continue;
      if (!determined(state, track)) continue;
      use_track(state, track, false, report);
      --budget;
    }
  }
}

template <class Config>
typename VisualUpdate<Config>::Use VisualUpdate<Config>::select_rows(const State& state, const Views& views,
                                                                     const KnownDepth* known, FrameReport& report) {
  constexpr double kRangeGate = 9.0;  // three sigmas, squared: what the range adds to the track's innovation
  const ConstMatrixView poses =
      state.covariance().block(kFirstColumn, kFirstColumn, Rows::kPoseColumns, Rows::kPoseColumns);
  with_range_ = false;
  const Status seen = build_track_rows(views, limits_, sigma_, plain_);
  const double plain = ok(seen) ? innovation_squared(plain_, poses) : 0.0;
  if (ok(seen)) {
    report.track_nis += plain;
    report.track_rows += static_cast<std::uint32_t>(plain_.pose_rows().rows());
    if (!(plain <= gate_.quantile(plain_.pose_rows().rows()))) return Use::kRejected;
  }
  if (known != nullptr && ok(build_track_rows(views, limits_, sigma_, ranged_, known))) {
    const double ranged = innovation_squared(ranged_, poses);
    if (ok(seen)) {
      report.ranged_nis += ranged - plain;
      ++report.ranged_judged;
    }
    with_range_ = ranged <= (ok(seen) ? plain + kRangeGate : gate_.quantile(ranged_.pose_rows().rows()));
  }
  if (ok(seen) || with_range_) return Use::kAccepted;
  return known != nullptr && seen == Status::kIllConditioned ? Use::kLater : Use::kRejected;
}

template <class Config>
void VisualUpdate<Config>::use_track(const State& state, TrackType& track, bool may_start, FrameReport& report) {
  const Views views = views_of(state, track);
  const std::optional<KnownDepth> known = known_depth(state, track, views);
  const Use use = select_rows(state, views, known ? &*known : nullptr, report);
  if (known) ++(with_range_ ? report.ranged_used : report.ranged_rejected);
  if (use == Use::kLater) {
    track.range.reset();  // a false echo is no fault of the track
    return;
  }
  ++(use == Use::kAccepted ? report.msckf_used : report.msckf_rejected);
  if (use == Use::kAccepted) {
    if (may_start) start_feature(track);
    const MatrixView seen = rows().pose_rows();
    scale_in_place(seen, 1.0 / std::sqrt(gate_.cost(seen.rows())));
    fold_rows(compressed_.view(), seen, Rows::kPoseColumns);
  }
  track.use_up();
}

template <class Config>
void VisualUpdate<Config>::start_feature(const TrackType& track) {
  spread_.add(track.samples.back().z);
  PendingFeature& pending = pending_[pending_count_++];
  pending.track_id = track.id;
  pending.feature = rows().feature;
  pending.anchor_slot = rows().anchor_slot;
  pending.ranged = with_range_;
  const ConstMatrixView from = rows().feature_rows();
  for (std::size_t r = 0; r < kFeatureSize; ++r) std::copy_n(from.row(r), from.cols(), pending.rows.view().row(r));
}

template <class Config>
void VisualUpdate<Config>::add_compressed_rows(const State& state, UpdateStack<Config>& stack) {
  constexpr double kNegligible = 1e-16;  // squared norm of a whitened row that carries rounding only
  constexpr std::size_t kTogether = 4;   // rows multiplied by the covariance at once
  FixedVector<std::size_t, kTogether> kept;
  for (std::size_t k = 0; k < Rows::kPoseColumns; ++k) {
    const double* from = compressed_.view().row(k);
    double norm2 = 0.0;
    for (std::size_t c = k; c < Rows::kPoseColumns; ++c) norm2 += from[c] * from[c];
    if (!(norm2 < kNegligible)) static_cast<void>(kept.push_back(k));
    if (!kept.full() && k + 1 < Rows::kPoseColumns) continue;
    add_compressed_rows(state, {kept.data(), kept.size()}, stack);
    kept.clear();
  }
}

template <class Config>
void VisualUpdate<Config>::add_compressed_rows(const State& state, std::span<const std::size_t> kept,
                                               UpdateStack<Config>& stack) {
  if (kept.empty()) return;
  MatrixView h = stack.open(kept.size());
  FixedVector<Support, Rows::kPoseColumns> supports;
  for (std::size_t r = 0; r < kept.size(); ++r) {
    const std::size_t k = kept[r];
    const double* from = compressed_.view().row(k);
    std::copy(from + k, from + Rows::kPoseColumns, h.row(r) + kFirstColumn + k);
    stack.residual(r) = from[Rows::kPoseColumns];
    Support support;
    static_cast<void>(support.push_back({kFirstColumn + k, Rows::kPoseColumns - k}));
    static_cast<void>(supports.push_back(support));
  }
  stack.close_untested(state, {supports.data(), supports.size()});
}

template <class Config>
void VisualUpdate<Config>::insert_pending(State& state, Table& tracks, const double* correction, FrameReport& report) {
  for (std::size_t i = 0; i < pending_count_; ++i) {
    const PendingFeature& pending = pending_[i];
    const ConstMatrixView rows = pending.rows.view();
    // H2 df + H1 dx = r1 + n, with H2 upper triangular: df = H2^-1 (r1 - H1 dx) + H2^-1 n.
    const Mat3 h2_inverse =
        Mat3(rows.fixed<3, 3>(0, 0)).template triangularView<Eigen::Upper>().solve(Mat3::Identity());
    double storage[kFeatureSize * Layout::kSize] = {};
    MatrixView jacobian(storage, kFeatureSize, state.size() + kFeatureSize, Layout::kSize);
    Vec3 residual;
    const double* dx = correction + kFirstColumn;
    for (std::size_t r = 0; r < kFeatureSize; ++r) {
      double sum = rows(r, Rows::kColumns - 1);
      for (std::size_t c = 0; c < Rows::kPoseColumns; ++c) sum -= rows(r, kFeatureSize + c) * dx[c];
      residual(static_cast<Eigen::Index>(r)) = sum;
    }
    for (std::size_t c = 0; c < Rows::kPoseColumns; ++c) {
      const Vec3 column(rows(0, kFeatureSize + c), rows(1, kFeatureSize + c), rows(2, kFeatureSize + c));
      const Vec3 solved = -h2_inverse * column;
      for (std::size_t r = 0; r < kFeatureSize; ++r)
        jacobian(r, kFirstColumn + c) = solved(static_cast<Eigen::Index>(r));
    }
    const SlamFeature feature{pending.track_id, pending.anchor_slot, pending.feature + h2_inverse * residual, 0,
                              pending.ranged};
    if (!feature.parameters.allFinite() || !(feature.parameters.z() > 0.0)) continue;
    Support support;
    static_cast<void>(support.push_back({kFirstColumn, Rows::kPoseColumns}));
    if (!ok(state.add_feature(feature, jacobian, support, h2_inverse * h2_inverse.transpose()))) return;
    tracks.find(pending.track_id)->in_state = true;
    ++report.slam_added;
  }
}

template <class Config>
void VisualUpdate<Config>::start_ranged(State& state, Table& tracks, FrameReport& report) {
  const auto waits = [](const TrackType& t) { return t.alive && full(t) && waits_for_laser(t); };
  for (std::size_t n = 0; n < kMaxStarts && ranged_places(state) > 0; ++n) {
    TrackType* track = best_for_start(tracks, waits);
    if (track == nullptr) return;
    const Views views = views_of(state, *track);
    const std::optional<KnownDepth> known = known_depth(state, *track, views);
    if (!known) {
      track->range.reset();
      continue;
    }
    const View& there = views[known->view];
    const Vec3 variances(sigma_ * sigma_, sigma_ * sigma_, known->sigma_1_m * known->sigma_1_m);
    const SlamFeature feature{track->id, there.pose_slot, {there.z.x(), there.z.y(), known->rho_1_m}, 0, true,
                              0,         state.t};
    if (!ok(state.add_feature(feature, Mat3(variances.asDiagonal())))) return;
    track->in_state = true;
    spread_.add(track->samples.back().z);
    track->use_up();
    ++report.slam_added;
  }
}

template <class Config>
void VisualUpdate<Config>::start_without_parallax(State& state, Table& tracks, const DepthPrior& prior,
                                                  FrameReport& report) {
  for (std::size_t n = 0; n < kMaxStarts && !state.features.full(); ++n) {
    TrackType* track = best_for_start(tracks, [](const TrackType& t) { return t.alive && full(t); });
    if (track == nullptr) return;
    const Vec2 z = track->samples.back().z;
    const SlamFeature feature{track->id, state.window().back(), FeatureParameters(z.x(), z.y(), prior.rho), 0, false};
    const Vec3 variances(sigma_ * sigma_, sigma_ * sigma_, prior.sigma * prior.sigma);
    if (!ok(state.add_feature(feature, Mat3(variances.asDiagonal())))) return;
    track->in_state = true;
    track->use_up();
    spread_.add(z);
    ++report.slam_added;
  }
}

template <class Config>
template <typename Passes>
typename VisualUpdate<Config>::TrackType* VisualUpdate<Config>::best_for_start(Table& tracks, Passes passes) const {
  TrackType* best = nullptr;
  std::uint32_t best_crowd = 0;
  for (TrackType& track : tracks.tracks()) {
    if (track.in_state || track.banned || track.samples.empty()) continue;
    const std::uint32_t crowd = spread_.crowd(track.samples.back().z);
    if (best != nullptr && (crowd > best_crowd || (crowd == best_crowd && track.age <= best->age))) continue;
    if (!passes(track)) continue;
    best = &track;
    best_crowd = crowd;
  }
  return best;
}

}  // namespace plumb
