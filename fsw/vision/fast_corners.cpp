#include "fsw/vision/fast_corners.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "fsw/base/assert.h"
#include "fsw/vision/vector_types.h"

namespace plumb {
namespace {

using Pixels = cv::v_uint8;
constexpr std::int32_t kLanes = Pixels::nlanes;

constexpr std::int32_t kRing = 16;
constexpr std::array<std::int32_t, kRing> kRing_u = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
constexpr std::array<std::int32_t, kRing> kRing_v = {3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1, 0, 1, 2, 3};

// Columns looked at together, with one more to the left and right for the suppression.
constexpr std::int32_t kStrip_px = 62;
constexpr std::int32_t kScores = kStrip_px + 2;
static_assert(kScores % kLanes == 0);
using ScoreRow = std::array<std::uint8_t, kScores + kLanes>;  // the last vector begins at the second column

using Ring = std::array<Pixels, kRing>;

// Which of two grey levels is nearer to the centre of the ring, and which further away, for pixels around it that are
// brighter or darker.
struct Brighter {
  static Pixels nearer(const Pixels& a, const Pixels& b) { return cv::v_min(a, b); }
  static Pixels further(const Pixels& a, const Pixels& b) { return cv::v_max(a, b); }
};
struct Darker {
  static Pixels nearer(const Pixels& a, const Pixels& b) { return cv::v_max(a, b); }
  static Pixels further(const Pixels& a, const Pixels& b) { return cv::v_min(a, b); }
};

/// The furthest grey level that 9 neighbouring pixels of the ring all reach. Each arc of 9 is an arc of 8 that begins
/// at an odd place and one of its two neighbours.
template <class Side>
Pixels reached_by_arc(const Ring& ring) {
  Ring pair;
  Ring four;
  for (std::size_t i = 1; i < kRing; i += 2) pair[i] = Side::nearer(ring[i], ring[(i + 1) % kRing]);
  for (std::size_t i = 1; i < kRing; i += 2) four[i] = Side::nearer(pair[i], pair[(i + 2) % kRing]);
  const auto nine = [&](std::size_t i) {
    const Pixels eight = Side::nearer(four[i], four[(i + 4) % kRing]);
    return Side::nearer(eight, Side::further(ring[i - 1], ring[(i + 8) % kRing]));
  };
  Pixels reached = nine(1);
  for (std::size_t i = 3; i < kRing; i += 2) reached = Side::further(reached, nine(i));
  return reached;
}

/// Not nearer than reached_by_arc(): an arc of 9 holds two neighbours of the four pixels above, below and beside the
/// centre.
template <class Side>
Pixels reach_bound(const Pixels& below, const Pixels& right, const Pixels& above, const Pixels& left) {
  return Side::nearer(Side::further(below, above), Side::further(right, left));
}

/// How far that is beyond the centre. A subtraction ends at 0.
Pixels strength_of(const Pixels& brightest, const Pixels& darkest, const Pixels& centre) {
  return cv::v_max(brightest - centre, centre - darkest);
}

/// False where no pixel's strength can be above `threshold`, which most of an image without texture is.
bool may_have_corners(const std::uint8_t* pixels, const std::array<std::ptrdiff_t, kRing>& ring,
                      const Pixels& threshold) {
  const Pixels centre = cv::vx_load(pixels);
  const Pixels below = cv::vx_load(pixels + ring[0]);
  const Pixels right = cv::vx_load(pixels + ring[4]);
  const Pixels above = cv::vx_load(pixels + ring[8]);
  const Pixels left = cv::vx_load(pixels + ring[12]);
  const Pixels bound = strength_of(reach_bound<Brighter>(below, right, above, left),
                                   reach_bound<Darker>(below, right, above, left), centre);
  return cv::v_check_any(bound > threshold);
}

/// Per pixel the smallest threshold at which it is no corner; 0 when that is not above `threshold`.
Pixels corner_strength(const std::uint8_t* pixels, const std::array<std::ptrdiff_t, kRing>& ring,
                       const Pixels& threshold) {
  Ring around;
  for (std::size_t i = 0; i < kRing; ++i) around[i] = cv::vx_load(pixels + ring[i]);
  const Pixels strength =
      strength_of(reached_by_arc<Brighter>(around), reached_by_arc<Darker>(around), cv::vx_load(pixels));
  return strength & (strength > threshold);
}

/// Strength of the pixels of one strip and row; the columns before `first` and from `end` on count as no corners.
void score_row(const std::uint8_t* pixels, const std::array<std::ptrdiff_t, kRing>& ring, const Pixels& threshold,
               std::int32_t first, std::int32_t end, ScoreRow& row) {
  for (std::int32_t i = 0; i < end; i += kLanes) {
    cv::v_store(row.data() + i, may_have_corners(pixels + i, ring, threshold)
                                    ? corner_strength(pixels + i, ring, threshold)
                                    : cv::vx_setzero_u8());
  }
  std::fill(row.begin(), row.begin() + first, std::uint8_t{0});
  std::fill(row.begin() + end, row.end(), std::uint8_t{0});
}

Pixels neighbour_strength(const std::uint8_t* at) {
  return cv::v_max(cv::vx_load(at), cv::v_max(cv::vx_load(at - 1), cv::vx_load(at + 1)));
}

/// Offers the pixels of a row that are stronger than all of their eight neighbours.
void offer_maxima(const ScoreRow& above, const ScoreRow& row, const ScoreRow& below, std::int32_t left_px,
                  std::int32_t row_px, CornerSink& sink) {
  for (std::int32_t first = 1; first <= kStrip_px; first += kLanes) {
    const Pixels strength = cv::vx_load(&row[first]);
    if (!cv::v_check_any(strength > cv::vx_setzero_u8())) continue;
    const Pixels beside = cv::v_max(cv::vx_load(&row[first - 1]), cv::vx_load(&row[first + 1]));
    const Pixels around = cv::v_max(neighbour_strength(&above[first]), neighbour_strength(&below[first]));
    const Pixels kept = strength & (strength > cv::v_max(beside, around));
    std::array<std::uint8_t, kLanes> strengths;
    cv::v_store(strengths.data(), kept);
    for (std::int32_t i = 0; i < std::min(kLanes, kStrip_px - first + 1); ++i) {
      if (strengths[i] == 0) continue;
      sink.offer(
          {static_cast<float>(left_px + first + i), static_cast<float>(row_px), static_cast<float>(strengths[i] - 1)});
    }
  }
}

}  // namespace

void detect_fast_corners(const ImageView& image, const TileRect& rect, std::int32_t threshold, CornerSink& sink) {
  PLUMB_ASSERT(threshold >= 1 && threshold <= 255);
  PLUMB_ASSERT(rect.left >= 0 && rect.top >= 0 && rect.right <= image.width && rect.bottom <= image.height);
  std::array<std::ptrdiff_t, kRing> ring;
  for (std::size_t i = 0; i < kRing; ++i) ring[i] = static_cast<std::ptrdiff_t>(kRing_v[i]) * image.stride + kRing_u[i];
  const Pixels limit = cv::vx_setall_u8(static_cast<std::uint8_t>(threshold));
  for (std::int32_t left = rect.left; left < rect.right; left += kStrip_px) {
    const std::int32_t first = left == rect.left ? 1 : 0;
    const std::int32_t end = std::min(rect.right - left + 1, kScores);
    std::array<ScoreRow, 3> rows{};  // a ring: above, the row itself, below
    const auto at = [&rows, &rect](std::int32_t v) -> ScoreRow& {
      return rows[static_cast<std::size_t>(v - rect.top + 1) % rows.size()];
    };
    for (std::int32_t v = rect.top; v <= rect.bottom; ++v) {
      if (v < rect.bottom) {
        const std::uint8_t* pixels = image.pixels + static_cast<std::ptrdiff_t>(v) * image.stride + left - 1;
        score_row(pixels, ring, limit, first, end, at(v));
      } else {
        at(v).fill(0);
      }
      if (v > rect.top) offer_maxima(at(v - 2), at(v - 1), at(v), left - 1, v - 1, sink);
    }
  }
}

}  // namespace plumb
