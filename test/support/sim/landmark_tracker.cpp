#include "test/support/sim/landmark_tracker.h"

#include <algorithm>

namespace plumb::sim {
namespace {

constexpr double kMinDepth_m = 0.05;
constexpr int kTriesPerTile = 10;       // of a random pixel before a tile counts as full
constexpr double kWallNormal_z = 0.3;   // a surface steeper than this is a side face
constexpr double kCrowdedShare = 0.35;  // of the spacing: two tracks that close are one to a real tracker

}  // namespace

LandmarkTracker::LandmarkTracker(const TrackerOptions& options, const World& world, const Rig& rig, std::uint64_t seed)
    : options_(options), world_(world), rig_(rig), camera_(rig.camera), random_(seed, kTrackerStream) {}

const std::vector<FeatureObservation>& LandmarkTracker::observe(const TruthState& truth, std::span<const Vec2> wanted,
                                                                std::size_t most) {
  std::erase_if(tracks_, [&](LandmarkTrack& track) { return !still_seen(truth, track); });
  drop_crowded();
  start_wanted(truth, wanted, most);
  replenish(truth);
  report();
  return observations_;
}

bool LandmarkTracker::project(const TruthState& truth, const Vec3& landmark_m, Vec2& pixel) const {
  const Vec3 in_camera = rig_.q_WC(truth).conjugate() * (landmark_m - rig_.p_WC_m(truth));
  if (in_camera.z() < kMinDepth_m || in_camera.z() > options_.max_depth_m) return false;
  if (!ok(camera_.distort(in_camera.head<2>() / in_camera.z(), pixel))) return false;
  const double border = options_.border_px;
  return pixel.x() >= border && pixel.x() <= rig_.camera.width - 1 - border && pixel.y() >= border &&
         pixel.y() <= rig_.camera.height - 1 - border;
}

bool LandmarkTracker::still_seen(const TruthState& truth, LandmarkTrack& track) {
  const bool dropped = random_.chance(options_.dropout);
  const bool confused = random_.chance(options_.mismatch);
  if (dropped || !project(truth, track.landmark_m, track.true_px)) return false;
  if (options_.occlusion && !world_.visible(rig_.p_WC_m(truth), track.landmark_m)) return false;
  if (confused) mismatch(truth, track);
  return true;
}

void LandmarkTracker::mismatch(const TruthState& truth, LandmarkTrack& track) {
  const double reach = options_.mismatch_px;
  const Vec2 jump(random_.uniform(-reach, reach), random_.uniform(-reach, reach));
  Vec3 landmark_m;
  Vec2 pixel;
  if (!find_landmark(truth, track.true_px + jump, landmark_m) || !project(truth, landmark_m, pixel)) return;
  track.landmark_m = landmark_m;
  track.true_px = pixel;
}

bool LandmarkTracker::find_landmark(const TruthState& truth, const Vec2& pixel, Vec3& landmark_m) const {
  Vec2 normalised;
  if (!ok(camera_.undistort(pixel, normalised))) return false;
  const Vec3 ray = (rig_.q_WC(truth) * normalised.homogeneous()).normalized();
  const std::optional<Hit> hit = world_.cast(rig_.p_WC_m(truth), ray, options_.max_depth_m);
  if (!hit || (!options_.side_faces && hit->normal.z() < kWallNormal_z)) return false;
  landmark_m = hit->point_m;
  return true;
}

void LandmarkTracker::drop_crowded() {
  const double limit_px = kCrowdedShare * options_.min_spacing_px;
  for (std::size_t i = 0; i < tracks_.size();) {  // the older one stays
    const bool crowded =
        std::any_of(tracks_.begin(), tracks_.begin() + static_cast<std::ptrdiff_t>(i),
                    [&](const LandmarkTrack& older) { return (older.true_px - tracks_[i].true_px).norm() < limit_px; });
    if (crowded) {
      tracks_.erase(tracks_.begin() + static_cast<std::ptrdiff_t>(i));
    } else {
      ++i;
    }
  }
}

int LandmarkTracker::tile_of(const Vec2& pixel) const {
  const int column = static_cast<int>(pixel.x() * options_.tiles_x / rig_.camera.width);
  const int row = static_cast<int>(pixel.y() * options_.tiles_y / rig_.camera.height);
  return std::clamp(row, 0, options_.tiles_y - 1) * options_.tiles_x + std::clamp(column, 0, options_.tiles_x - 1);
}

void LandmarkTracker::start_wanted(const TruthState& truth, std::span<const Vec2> wanted, std::size_t most) {
  for (const Vec2& z : wanted) {
    Vec2 pixel;
    if (tracks_.size() >= most || !ok(camera_.distort(z, pixel))) continue;
    start_at(truth, pixel, kCrowdedShare * options_.min_spacing_px);
  }
}

void LandmarkTracker::replenish(const TruthState& truth) {
  std::vector<int> load(static_cast<std::size_t>(options_.tiles_x * options_.tiles_y), 0);
  for (const LandmarkTrack& track : tracks_) ++load[tile_of(track.true_px)];
  while (static_cast<int>(tracks_.size()) < options_.target_tracks) {
    const auto emptiest = std::min_element(load.begin(), load.end());
    if (*emptiest >= options_.target_tracks) return;  // no tile left that yields features
    const bool started = start_track(truth, static_cast<int>(emptiest - load.begin()));
    *emptiest = started ? *emptiest + 1 : options_.target_tracks;
  }
}

bool LandmarkTracker::start_track(const TruthState& truth, int tile) {
  const double width_px = static_cast<double>(rig_.camera.width) / options_.tiles_x;
  const double height_px = static_cast<double>(rig_.camera.height) / options_.tiles_y;
  for (int attempt = 0; attempt < kTriesPerTile; ++attempt) {
    const double column = tile % options_.tiles_x + random_.uniform();
    const double row = tile / options_.tiles_x + random_.uniform();
    const Vec2 pixel(column * width_px - 0.5, row * height_px - 0.5);
    if (start_at(truth, pixel, options_.min_spacing_px)) return true;
  }
  return false;
}

bool LandmarkTracker::start_at(const TruthState& truth, const Vec2& pixel, double spacing_px) {
  const bool crowded = std::any_of(tracks_.begin(), tracks_.end(), [&](const LandmarkTrack& other) {
    return (other.true_px - pixel).norm() < spacing_px;
  });
  LandmarkTrack track;
  if (crowded || !find_landmark(truth, pixel, track.landmark_m)) return false;
  if (!project(truth, track.landmark_m, track.true_px)) return false;
  track.id = next_id_++;
  tracks_.push_back(track);
  return true;
}

void LandmarkTracker::report() {
  observations_.clear();
  std::erase_if(tracks_, [&](const LandmarkTrack& track) {
    Vec2 pixel = track.true_px;
    pixel.x() += options_.pixel_noise_px * random_.normal();
    pixel.y() += options_.pixel_noise_px * random_.normal();
    if (random_.chance(options_.outlier)) {
      pixel.x() += random_.uniform(-options_.outlier_px, options_.outlier_px);
      pixel.y() += random_.uniform(-options_.outlier_px, options_.outlier_px);
    }
    Vec2 normalised;
    if (!ok(camera_.undistort(pixel, normalised))) return true;  // pushed off the part of the lens that is modelled
    observations_.push_back(
        {track.id, static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), normalised.x(), normalised.y()});
    return false;
  });
}

}  // namespace plumb::sim
