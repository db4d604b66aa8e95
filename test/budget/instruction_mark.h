#pragma once
// Marks in a program whose instructions are counted (instruction_trace.c).

#include <unistd.h>

#include <cstddef>
#include <cstdint>

#include "fsw/base/stage_observer.h"

namespace plumb::budget {

/// What a mark says: a region begins or ends, or an image, or a tick, is done. instruction_budget.py and tick_budget.py
/// read the same numbers.
enum class Region : std::uint8_t {
  kStages = 0,  ///< the stages of fsw/base/stage_observer.h, in their order
  kStep = 16,   ///< the nav job for one tick, outside the other regions
  kPyramid,     ///< building the pyramid of an image
  kFlow,        ///< following points from image to image, there and back
  kDetect,      ///< looking for corners
  kTick,        ///< a tick of the executive, outside its jobs
  kJobs,        ///< the jobs of fsw/app/flight_schedule.h, in their order
  kImage = 31,  ///< its end: the counts since the last one are those of an image, or of a tick
};

/// The system call fails and does nothing; the plugin sees it.
inline void mark(std::uint8_t tag) {
  constexpr int kNoDescriptor = -7;
  // The tag stands where the address would; nothing is read.
  if (write(kNoDescriptor, reinterpret_cast<const void*>(static_cast<std::uintptr_t>(tag)), 0) >= 0) _exit(1);
}
constexpr std::uint8_t begin_tag(std::uint8_t region) { return static_cast<std::uint8_t>(2 * region); }
constexpr std::uint8_t end_tag(std::uint8_t region) { return static_cast<std::uint8_t>(2 * region + 1); }
inline void begin(std::uint8_t region) { mark(begin_tag(region)); }
inline void end(std::uint8_t region) { mark(end_tag(region)); }

class RegionScope {
 public:
  explicit RegionScope(Region region) : region_(static_cast<std::uint8_t>(region)) { begin(region_); }
  ~RegionScope() { end(region_); }
  RegionScope(const RegionScope&) = delete;
  RegionScope& operator=(const RegionScope&) = delete;

 private:
  std::uint8_t region_;
};

class MarkingObserver final : public StageObserver {
 public:
  void enter(Stage stage) override { begin(static_cast<std::uint8_t>(stage)); }
  void leave(Stage stage) override { end(static_cast<std::uint8_t>(stage)); }
};

}  // namespace plumb::budget
