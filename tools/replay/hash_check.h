#pragma once
// Compares the state hashes of a replay with those recorded in the log: equal means the same bits, image by image.

#include <cstdint>
#include <optional>

#include "tools/replay/flight.h"
#include "tools/replay/session.h"

namespace plumb::replay {

class HashCheck final : public FlightListener {
 public:
  explicit HashCheck(const Session& session) : session_(session) {}

  void on_image(const ImageRecord& record) override {
    const auto recorded = session_.recorded_hashes.find(record.nav.sequence);
    if (recorded == session_.recorded_hashes.end()) return;
    ++compared_;
    if (recorded->second == record.nav.state_hash) return;
    ++different_;
    if (!first_different_) first_different_ = record.nav.sequence;
  }

  std::uint64_t compared() const { return compared_; }
  std::uint64_t different() const { return different_; }
  /// Sequence of the first image whose state differs.
  std::optional<std::uint32_t> first_different() const { return first_different_; }

 private:
  const Session& session_;
  std::uint64_t compared_ = 0;
  std::uint64_t different_ = 0;
  std::optional<std::uint32_t> first_different_;
};

}  // namespace plumb::replay
