#pragma once
// The flight software knows no clock. Whoever wants to know what a stage of the nav job costs hands in an observer.

#include <cstddef>
#include <cstdint>

namespace plumb {

enum class Stage : std::uint8_t {
  kFrontEnd = 0,    ///< images to feature tracks
  kInitialisation,  ///< standstill or in-motion start, re-run of the buffered window included
  kPropagation,     ///< IMU to the image time, window slide and clone
  kRange,           ///< facet search and range update
  kVisualRows,      ///< triangulation, null space, gates
  kVisualUpdate,    ///< the joint update
};
inline constexpr std::size_t kStageCount = 6;

constexpr const char* to_string(Stage stage) {
  switch (stage) {
    case Stage::kFrontEnd: return "front_end";
    case Stage::kInitialisation: return "initialisation";
    case Stage::kPropagation: return "propagation";
    case Stage::kRange: return "range";
    case Stage::kVisualRows: return "visual_rows";
    case Stage::kVisualUpdate: return "visual_update";
  }
  return "unknown";
}

class StageObserver {
 public:
  virtual void enter(Stage stage) = 0;
  virtual void leave(Stage stage) = 0;

 protected:
  // Nobody owns one through this interface, and a virtual destructor would pull operator delete into flight code.
  ~StageObserver() = default;
};

/// Marks a stage for the length of a scope. Stages do not nest. A null observer costs a compare.
class StageScope {
 public:
  StageScope(StageObserver* observer, Stage stage) : observer_(observer), stage_(stage) {
    if (observer_ != nullptr) observer_->enter(stage_);
  }
  ~StageScope() {
    if (observer_ != nullptr) observer_->leave(stage_);
  }
  StageScope(const StageScope&) = delete;
  StageScope& operator=(const StageScope&) = delete;

 private:
  StageObserver* observer_;
  Stage stage_;
};

}  // namespace plumb
