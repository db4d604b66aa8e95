#pragma once
// An OV7251 in software, with two faces: the bus, where exposure and gain are written and images come as a bridge
// delivers them, and the world, where a test sets what the sensor sees and what is wrong with it. Written from the
// register meanings of Linux's driver; it shares no code with Plumb's.

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

namespace plumb::emulator {

/// One image as it leaves the bridge.
struct Ov7251Image {
  std::vector<std::uint16_t> pixels;  ///< 10 bits each, row by row
  std::uint32_t sequence = 0;
  std::int64_t start_of_exposure_ns = 0;
  std::int64_t end_of_exposure_ns = 0;
  std::int64_t end_of_frame_ns = 0;
  int exposure_lines = 0;
  int gain = 0;  ///< sixteenths
  bool damaged = false;

  std::int64_t middle_ns() const { return (start_of_exposure_ns + end_of_exposure_ns) / 2; }
};

/// Pixel layouts of a bridge, with `padding` bytes after each row.
std::vector<std::uint8_t> as_grey(const Ov7251Image& image, int padding = 0);
std::vector<std::uint8_t> as_y10(const Ov7251Image& image, int padding = 0);
std::vector<std::uint8_t> as_y10_packed(const Ov7251Image& image, int padding = 0);

class Ov7251Emulator {
 public:
  static constexpr int kWidth = 640;
  static constexpr int kHeight = 480;

  /// Begins its first frame at `t_ns`. The noise of the pixels follows from the seed.
  Ov7251Emulator(std::int64_t t_ns, std::uint64_t seed) : t_frame_ns_(t_ns), noise_(seed | 1U) {}

  // The bus.
  /// Lines per frame, blanking included.
  void set_frame_lines(int lines) { frame_lines_ = lines; }
  /// Registers act on a frame that begins afterwards, see World. Values beyond what the sensor has are brought into it;
  /// returns what was written.
  int write_exposure_lines(int lines);
  int write_gain(int sixteenths);
  /// The end of the frame that next_image() returns.
  std::int64_t next_end_ns() const;
  /// Nothing: the frame got lost.
  std::optional<Ov7251Image> next_image();

  // The world.
  /// What each pixel sees: the part of its range that an exposure of 1 ms with gain 1 fills.
  void set_scene(std::function<double(int u, int v)> fill_per_ms);
  void set_scene(double fill_per_ms) {
    set_scene([fill_per_ms](int, int) { return fill_per_ms; });
  }
  struct World {
    int lose_next = 0;          ///< frames that do not get through
    bool counts_lost = true;    ///< whether the sequence counts them
    int damage_next = 0;        ///< frames that are not whole
    bool frozen = false;        ///< the last image comes again and again
    int control_delay = 2;      ///< a register acts on the first or the second frame that begins
    double noise_counts = 1.5;  ///< 1 sigma, of 1023
  };
  World world;

  // What the sensor has seen.
  int exposures_written() const { return exposures_written_; }
  std::int64_t period_ns() const { return frame_lines_ * kLine_ns; }
  static constexpr std::int64_t kLine_ns = 19'333;

 private:
  struct Registers {
    int exposure_lines = 504;
    int gain = 16;
  };
  std::uint16_t pixel(double fill);

  int frame_lines_ = 1724;
  std::int64_t t_frame_ns_;
  std::uint32_t sequence_ = 0;
  Registers written_;
  std::deque<Registers> pending_;  ///< of the frames to come
  std::vector<float> scene_ = std::vector<float>(kWidth * kHeight, 0.05F);
  std::vector<std::uint16_t> last_pixels_;
  std::uint64_t noise_;
  int exposures_written_ = 0;
};

}  // namespace plumb::emulator
