#include "fsw/vision/fast_corners.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <opencv2/core/hal/intrin.hpp>

#include "fsw/base/assert.h"

namespace plumb {
namespace {

using Pixels = cv::v_uint8x16;
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

/// The largest number that 9 neighbouring ones of the ring all reach. Each arc of 9 is an arc of 8 that begins at an
/// odd place and one of its two neighbours.
inline Pixels arc_strength(const Ring& ring) {
  Ring pair;
  Ring four;
  Pixels strongest = cv::v_setzero_u8();
  for (std::size_t i = 1; i < kRing; i += 2) pair[i] = cv::v_min(ring[i], ring[(i + 1) % kRing]);
  for (std::size_t i = 1; i < kRing; i += 2) four[i] = cv::v_min(pair[i], pair[(i + 2) % kRing]);
  for (std::size_t i = 1; i < kRing; i += 2) {
    const Pixels eight = cv::v_min(four[i], four[(i + 4) % kRing]);
    strongest = cv::v_max(strongest, cv::v_min(eight, cv::v_max(ring[i - 1], ring[(i + 8) % kRing])));
  }
  return strongest;
}

/// No less than arc_strength(): an arc of 9 holds two neighbours of the four pixels above, below and beside the centre.
inline Pixels strength_bound(const Pixels& below, const Pixels& right, const Pixels& above, const Pixels& left) {
  return cv::v_min(cv::v_max(below, above), cv::v_max(right, left));
}

/// False where no pixel's strength can be above `threshold`, which most of an image without texture is.
bool may_have_corners(const std::uint8_t* pixels, const std::array<std::ptrdiff_t, kRing>& ring,
                      const Pixels& threshold) {
  const Pixels centre = cv::v_load(pixels);
  const Pixels below = cv::v_load(pixels + ring[0]);
  const Pixels right = cv::v_load(pixels + ring[4]);
  const Pixels above = cv::v_load(pixels + ring[8]);
  const Pixels left = cv::v_load(pixels + ring[12]);
  const Pixels brighter = strength_bound(below - centre, right - centre, above - centre, left - centre);
  const Pixels darker = strength_bound(centre - below, centre - right, centre - above, centre - left);
  return cv::v_check_any(cv::v_max(brighter, darker) > threshold);
}

/// Per pixel the smallest threshold at which it is no corner; 0 when that is not above `threshold`.
Pixels corner_strength(const std::uint8_t* pixels, const std::array<std::ptrdiff_t, kRing>& ring,
                       const Pixels& threshold) {
  const Pixels centre = cv::v_load(pixels);
  Ring brighter;
  Ring darker;
  for (std::size_t i = 0; i < kRing; ++i) {
    const Pixels around = cv::v_load(pixels + ring[i]);  // subtraction ends at 0
    brighter[i] = around - centre;
    darker[i] = centre - around;
  }
  const Pixels strength = cv::v_max(arc_strength(brighter), arc_strength(darker));
  return strength & (strength > threshold);
}

/// Strength of the pixels of one strip and row; the columns before `first` and from `end` on count as no corners.
void score_row(const std::uint8_t* pixels, const std::array<std::ptrdiff_t, kRing>& ring, const Pixels& threshold,
               std::int32_t first, std::int32_t end, ScoreRow& row) {
  for (std::int32_t i = 0; i < end; i += kLanes) {
    cv::v_store(row.data() + i, may_have_corners(pixels + i, ring, threshold)
                                    ? corner_strength(pixels + i, ring, threshold)
                                    : cv::v_setzero_u8());
  }
  std::fill(row.begin(), row.begin() + first, std::uint8_t{0});
  std::fill(row.begin() + end, row.end(), std::uint8_t{0});
}

Pixels neighbour_strength(const std::uint8_t* at) {
  return cv::v_max(cv::v_load(at), cv::v_max(cv::v_load(at - 1), cv::v_load(at + 1)));
}

/// Offers the pixels of a row that are stronger than all of their eight neighbours.
void offer_maxima(const ScoreRow& above, const ScoreRow& row, const ScoreRow& below, std::int32_t left_px,
                  std::int32_t row_px, CornerSink& sink) {
  for (std::int32_t first = 1; first <= kStrip_px; first += kLanes) {
    const Pixels strength = cv::v_load(&row[first]);
    if (!cv::v_check_any(strength > cv::v_setzero_u8())) continue;
    const Pixels beside = cv::v_max(cv::v_load(&row[first - 1]), cv::v_load(&row[first + 1]));
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
  const Pixels limit = cv::v_setall_u8(static_cast<std::uint8_t>(threshold));
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
