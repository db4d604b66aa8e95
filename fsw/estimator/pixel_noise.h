#pragma once
// The noise of a tracked feature, followed on line. Half of all innovations of a well-tuned filter have a normalised
// square (two degrees of freedom) below 2 ln 2. Where the median over the SLAM features of an image lies elsewhere, the
// noise moves a small step that way, in proportion and within limits: outliers do not move a median, and no image moves
// the noise by much. After the adaptive noise of XIVO (github.com/feixh/xivo), which steps faster.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fsw/base/fixed_vector.h"
#include "fsw/base/hash.h"
#include "fsw/estimator/options.h"
#include "fsw/math/exact.h"

namespace plumb {

template <std::size_t MaxFeatures>
class PixelNoise {
 public:
  explicit PixelNoise(const VisionOptions& options) : options_(options) { clear(); }

  /// Other options from here on. Noise that follows the innovations goes on from where it is.
  void use(const VisionOptions& options) {
    options_ = options;
    if (!adapts()) clear();
  }
  /// Back to what the options say.
  void clear() { sigma_px_ = options_.pixel_noise_px; }
  bool adapts() const { return options_.pixel_noise_images > 0; }
  /// 1 sigma per axis.
  double sigma_px() const { return sigma_px_; }

  void begin_image() { nis_.clear(); }
  /// The normalised squared innovation of one feature of this image, used or not.
  void add(double nis) {
    if (adapts() && std::isfinite(nis)) static_cast<void>(nis_.push_back(nis));
  }

  /// The image is complete: the noise for the next one.
  void follow() {
    constexpr std::size_t kMinFeatures = 8;  // fewer say too little
    constexpr double kMedian = 2.0 * std::numbers::ln2;
    if (nis_.size() >= kMinFeatures) {
      const auto middle = nis_.begin() + nis_.size() / 2;
      std::nth_element(nis_.begin(), middle, nis_.end());
      const double step = std::clamp(exact::log(std::max(*middle, kMedian / 16.0) / kMedian), -1.0, 1.0);
      const double grown_px = sigma_px_ * exact::exp(0.5 * step / options_.pixel_noise_images);
      sigma_px_ = std::clamp(grown_px, options_.pixel_noise_min_px, options_.pixel_noise_max_px);
    }
  }

  void add_to(Hash64& hash) const {
    if (adapts()) hash.add(sigma_px_);
  }

 private:
  VisionOptions options_;
  double sigma_px_ = 0.0;
  FixedVector<double, MaxFeatures> nis_;  ///< of the image at hand
};

}  // namespace plumb
