#pragma once
// Compares the state hashes of a replay with those recorded in the log: equal means the same bits, image by image.

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <set>

#include "tools/replay/flight.h"
#include "tools/replay/session.h"

namespace plumb::replay {

class HashCheck final : public FlightListener {
 public:
  explicit HashCheck(const Session& session) : missing_(session.recorded_hashes), recorded_(missing_.size()) {}

  void on_image(const ImageRecord& record) override {
    const auto recorded = missing_.find(record.nav.sequence);
    if (recorded == missing_.end()) return;
    if (recorded->second != record.nav.state_hash) different_.insert(record.nav.sequence);
    missing_.erase(recorded);
  }

  std::uint64_t recorded() const { return recorded_; }
  /// States that differ from the recorded ones or did not come again.
  std::uint64_t different() const { return different_.size() + missing_.size(); }
  /// Sequence of the first image whose state differs or is missing.
  std::optional<std::uint32_t> first_different() const {
    if (different() == 0) return std::nullopt;
    const std::uint32_t wrong = different_.empty() ? UINT32_MAX : *different_.begin();
    const std::uint32_t gone = missing_.empty() ? UINT32_MAX : missing_.begin()->first;
    return std::min(wrong, gone);
  }

 private:
  std::map<std::uint32_t, std::uint64_t> missing_;  ///< recorded ones that have not come again yet
  std::uint64_t recorded_;
  std::set<std::uint32_t> different_;
};

}  // namespace plumb::replay
