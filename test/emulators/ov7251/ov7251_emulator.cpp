#include "test/emulators/ov7251/ov7251_emulator.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace plumb::emulator {
namespace {

constexpr int kFullScale = 1023;
constexpr int kUnexposedLines = 20;
constexpr int kMinGain = 16;
constexpr int kMaxGain = 1023;

template <typename PutRow>
std::vector<std::uint8_t> rows(const Ov7251Image& image, int padding, PutRow put_row) {
  std::vector<std::uint8_t> bytes;
  for (int v = 0; v < Ov7251Emulator::kHeight; ++v) {
    put_row(image.pixels.data() + v * Ov7251Emulator::kWidth, bytes);
    bytes.insert(bytes.end(), static_cast<std::size_t>(padding), 0xEE);
  }
  return bytes;
}

std::uint8_t low(unsigned value) { return static_cast<std::uint8_t>(value & 0xFFU); }

}  // namespace

std::vector<std::uint8_t> as_grey(const Ov7251Image& image, int padding) {
  return rows(image, padding, [](const std::uint16_t* row, std::vector<std::uint8_t>& bytes) {
    for (int u = 0; u < Ov7251Emulator::kWidth; ++u) bytes.push_back(low(row[u] / 4U));
  });
}

std::vector<std::uint8_t> as_y10(const Ov7251Image& image, int padding) {
  return rows(image, padding, [](const std::uint16_t* row, std::vector<std::uint8_t>& bytes) {
    for (int u = 0; u < Ov7251Emulator::kWidth; ++u) {
      bytes.push_back(low(row[u]));
      bytes.push_back(low(row[u] / 256U));
    }
  });
}

std::vector<std::uint8_t> as_y10_packed(const Ov7251Image& image, int padding) {
  return rows(image, padding, [](const std::uint16_t* row, std::vector<std::uint8_t>& bytes) {
    for (int u = 0; u < Ov7251Emulator::kWidth; u += 4) {
      unsigned rest = 0;
      for (int i = 0; i < 4; ++i) {
        bytes.push_back(low(row[u + i] / 4U));
        rest += (row[u + i] % 4U) << (2 * i);
      }
      bytes.push_back(low(rest));
    }
  });
}

int Ov7251Emulator::write_exposure_lines(int lines) {
  written_.exposure_lines = std::clamp(lines, 1, frame_lines_ - kUnexposedLines);
  ++exposures_written_;
  return written_.exposure_lines;
}

int Ov7251Emulator::write_gain(int sixteenths) {
  written_.gain = std::clamp(sixteenths, kMinGain, kMaxGain);
  return written_.gain;
}

void Ov7251Emulator::set_scene(std::function<double(int u, int v)> fill_per_ms) {
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u)
      scene_[static_cast<std::size_t>(v * kWidth + u)] = static_cast<float>(fill_per_ms(u, v));
  }
}

std::int64_t Ov7251Emulator::next_end_ns() const { return t_frame_ns_ + period_ns(); }

std::uint16_t Ov7251Emulator::pixel(double fill) {
  // Four bytes of a congruential generator, summed: nearly Gaussian, and fast.
  noise_ = noise_ * 6364136223846793005ULL + 1442695040888963407ULL;
  double sum = -2.0 * 255.0;
  for (int shift = 32; shift < 64; shift += 8) sum += static_cast<double>((noise_ >> shift) & 0xFFU);
  constexpr double kSigmaOfSum = 147.8;  // of four uniform bytes
  const double value = fill * kFullScale + sum / kSigmaOfSum * world.noise_counts;
  return static_cast<std::uint16_t>(std::clamp(std::lround(value), 0L, static_cast<long>(kFullScale)));
}

std::optional<Ov7251Image> Ov7251Emulator::next_image() {
  // What was written while this frame was made acts on the next one, or on the one after that.
  pending_.push_back(written_);
  while (pending_.size() > static_cast<std::size_t>(world.control_delay) + 1) pending_.pop_front();
  const Registers acting = pending_.front();
  const std::int64_t end_of_frame_ns = next_end_ns();
  t_frame_ns_ = end_of_frame_ns;
  if (world.lose_next > 0) {
    --world.lose_next;
    if (world.counts_lost) ++sequence_;
    return std::nullopt;
  }
  Ov7251Image image;
  image.sequence = sequence_++;
  image.end_of_frame_ns = end_of_frame_ns;
  image.end_of_exposure_ns = end_of_frame_ns - kHeight * kLine_ns;
  image.exposure_lines = acting.exposure_lines;
  image.gain = acting.gain;
  image.start_of_exposure_ns = image.end_of_exposure_ns - acting.exposure_lines * kLine_ns;
  image.damaged = world.damage_next > 0;
  if (image.damaged) --world.damage_next;
  if (world.frozen && !last_pixels_.empty()) {
    image.pixels = last_pixels_;
    return image;
  }
  const double light_ms = static_cast<double>(acting.exposure_lines * kLine_ns) * 1e-6 * acting.gain / kMinGain;
  image.pixels.resize(scene_.size());
  std::transform(scene_.begin(), scene_.end(), image.pixels.begin(),
                 [&](float fill_per_ms) { return pixel(static_cast<double>(fill_per_ms) * light_ms); });
  last_pixels_ = image.pixels;
  return image;
}

}  // namespace plumb::emulator
