#pragma once
// One image into the filter: SLAM features, tracks that end or fill the window (MSCKF), and the start of new features,
// all in one joint update (paper section III-B, hybrid SLAM-MSCKF).

#include <algorithm>
#include <optional>
#include <span>

#include "fsw/base/stage_observer.h"
#include "fsw/estimator/chi_square.h"
#include "fsw/estimator/feature_spread.h"
#include "fsw/estimator/pixel_noise.h"
#include "fsw/estimator/report.h"
#include "fsw/estimator/track_rows.h"
#include "fsw/estimator/update_stack.h"
#include "fsw/vision/track_table.h"

namespace plumb {

/// Depth that a new feature is given when its track cannot tell.
struct DepthPrior {
  double rho = 0.0;    ///< 1/m
  double sigma = 0.0;  ///< 1/m
};

/// How the filter has learnt the scale, or is about to.
struct ScaleEvidence {
  bool excited = false;         ///< it started in motion whose acceleration told the scale
  bool ranges_to_come = false;  ///< tracks with a range are about to, so that features can wait for it
};

template <class Config>
class VisualUpdate {
 public:
  using State = FilterState<Config>;
  using Table = TrackTable<Config::kMaxTracks, Config::kMaxPoses>;
  using Layout = ErrorLayout<Config>;

  /// `max_ranged`: features in the state that may be ranged ones; they go before others.
  VisualUpdate(const VisionOptions& options, const SensorCalibration& calibration, int max_ranged);

  /// Preconditions: the newest window pose is that of the image just appended to `tracks`. Ended tracks are used and
  /// then dropped from the table. kNumericalFault: the state cannot be trusted any more.
  Status run(State& state, Table& tracks, UpdateStack<Config>& stack, const DepthPrior& prior,
             const ScaleEvidence& scale, FrameReport& report, StageObserver* observer);

  /// Other options from the next run() on, with the most features that may be ranged ones.
  void use(const VisionOptions& options, int max_ranged);
  /// Lets the pixel noise follow the innovations of the last run().
  void follow_noise() {
    noise_.follow();
    set_sigma();
  }
  /// Forgets what was learnt of the pixel noise.
  void clear() {
    noise_.clear();
    set_sigma();
  }
  /// What is remembered from image to image.
  void add_to(Hash64& hash) const { noise_.add_to(hash); }
  double pixel_noise_px() const { return noise_.sigma_px(); }

 private:
  static constexpr std::size_t kMaxStarts = 8;  ///< new features per image
  using TrackType = typename Table::TrackType;
  using Rows = TrackRows<Config::kMaxPoses, Layout::kPoses - Layout::kBeam>;
  static constexpr std::size_t kFirstColumn = Layout::kBeam;  ///< of a track's rows, in the error state

  /// A track that was gated and waits for the joint update to become a feature.
  struct PendingFeature {
    std::uint32_t track_id = 0;
    FeatureParameters feature = FeatureParameters::Zero();
    std::size_t anchor_slot = 0;
    bool ranged = false;
    MatrixStorage<kFeatureSize, Rows::kColumns> rows;
  };

  void set_sigma();
  /// Whether the scale is known well enough for features to enter the state. While it is known to a few percent only,
  /// the rows that hold a feature to the poses are taken at one scale after another, and between them tell the scale,
  /// which none of them has seen: after a start in slow motion, position was five times as sure as it was right. Tracks
  /// are used once, at one state, and have no such memory.
  bool scale_known(const State& state) const;
  void remove_lost(State& state, Table& tracks);
  void add_slam_rows(State& state, Table& tracks, UpdateStack<Config>& stack, FrameReport& report);
  void add_tracks(State& state, Table& tracks, bool excited, FrameReport& report);
  /// What is to be done with a track. kLater: its observations are of no use yet.
  enum class Use : std::uint8_t { kAccepted, kRejected, kLater };
  void use_track(const State& state, TrackType& track, bool may_start, FrameReport& report);
  void start_feature(const TrackType& track);
  /// Of the track at hand: what select_rows() chose.
  Rows& rows() { return with_range_ ? ranged_ : plain_; }
  /// With its range, unless that contradicts the observations, which are judged first and alone.
  Use select_rows(const State& state, const Views& views, const KnownDepth* known, FrameReport& report);
  std::optional<KnownDepth> known_depth(const State& state, const TrackType& track, const Views& views) const;
  void add_compressed_rows(const State& state, UpdateStack<Config>& stack);
  void add_compressed_rows(const State& state, std::span<const std::size_t> kept, UpdateStack<Config>& stack);
  void insert_pending(State& state, Table& tracks, const double* correction, FrameReport& report);
  /// Tracks with a range that have shown no parallax: their depth is the range's alone, whatever the scale.
  void start_ranged(State& state, Table& tracks, FrameReport& report);
  void start_without_parallax(State& state, Table& tracks, const DepthPrior& prior, FrameReport& report);

  static bool full(const TrackType& track) { return track.samples.size() == Config::kMaxPoses; }
  /// Used though it goes on and the window is not full: after a start in motion, whose velocity is wrong by centimetres
  /// a second, tracks as long as half a window tell more, sooner, than its filling is worth. Not where ranges alone
  /// have told the scale: short tracks, taken at one scale after another, would seem to tell it too.
  static bool early(const State& state, const TrackType& track) {
    const std::size_t length = track.samples.size();
    return !state.window().full() && length == state.window().size() && 2 * length >= Config::kMaxPoses;
  }
  /// The laser stays at it: it becomes a feature that ranges are compared with.
  static bool waits_for_laser(const TrackType& track) { return track.range && track.range->stays; }
  /// May become a feature or an MSCKF measurement: it shows parallax. A ranged track needs less, but some, because
  /// without any nothing would tell a false echo.
  bool determined(const State& state, const TrackType& track) const;
  /// Features that may still be ranged ones.
  std::size_t ranged_places(const State& state) const;
  /// A track that is as long as the window and may become a feature; null when there is none or no place for it.
  TrackType* next_start(const State& state, Table& tracks) const;
  Views views_of(const State& state, const TrackType& track) const;
  /// Of the tracks that pass, the one where features are least crowded, then the oldest, then the lowest id; null when
  /// none passes.
  template <typename Passes>
  TrackType* best_for_start(Table& tracks, Passes passes) const;

  VisionOptions options_;
  std::size_t max_ranged_ = 0;
  double focal_px_;
  PixelNoise<Config::kMaxSlamFeatures> noise_;
  double sigma_ = 0.0;  ///< pixel noise in the normalised plane
  TriangulationLimits limits_;
  double ranged_min_parallax_ = 0.0;
  FeatureSpread spread_;
  ChiSquareTable gate_;

  MatrixStorage<Rows::kPoseColumns, Rows::kPoseColumns + 1> compressed_;
  Rows plain_;               ///< of the track without its range
  Rows ranged_;              ///< of the same track with it
  bool with_range_ = false;  ///< which of the two is used
  std::array<PendingFeature, kMaxStarts> pending_;
  std::size_t pending_count_ = 0;
};

}  // namespace plumb

#include "fsw/estimator/visual_update.inl"
