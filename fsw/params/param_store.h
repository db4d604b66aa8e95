#pragma once
// The values of a parameter table that are in force, in two copies with a CRC. A change goes into the standby copy and
// then in force; in between both are equal, and when memory fails, two of the three still agree.

#include <array>
#include <bit>
#include <cstdint>
#include <utility>

#include "fsw/base/assert.h"
#include "fsw/params/param_table.h"

namespace plumb {

/// What a look at the copies found.
enum class ParamDamage : std::uint8_t {
  kNone = 0,
  kActive,        ///< the copy in force, taken back from the standby copy
  kStandby,       ///< the standby copy, taken back from the one in force
  kChecksum,      ///< the CRC, computed anew
  kBeyondRepair,  ///< no two agree: what is in force stays
};

template <class S>
class ParamStore {
 public:
  /// `table` must outlive the store.
  ParamStore(const ParamTable<S>& table, const S& values)
      : table_(table), active_(values), standby_(values), crc_(crc_of(values)) {}

  /// In force.
  const S& active() const { return active_; }

  /// Precondition: the row takes the value.
  void set(const ParamRow<S>& row, double value) {
    PLUMB_ASSERT(ParamTable<S>::accepts(row, value));
    mend();  // damage must not get under a new CRC
    row.set(standby_, value);
    active_ = standby_;
    crc_ = crc_of(active_);
  }

  /// Looks at the copies and mends what can be mended. Says what was found since the last call.
  ParamDamage check() {
    mend();
    return std::exchange(found_, ParamDamage::kNone);
  }

 private:
  friend struct ParamStoreSeam;  ///< of tests, which damage what is in memory

  /// Of all values, bit by bit.
  std::uint32_t crc_of(const S& values) const {
    std::uint32_t crc = 0;
    for (const ParamRow<S>& row : table_.rows()) {
      crc = crc32(std::bit_cast<std::array<std::uint8_t, sizeof(double)>>(row.get(values)), crc);
    }
    return crc;
  }

  void mend() {
    const std::uint32_t active = crc_of(active_);
    const std::uint32_t standby = crc_of(standby_);
    if (active == crc_ && standby == crc_) return;
    if (standby == crc_) {
      found_ = ParamDamage::kActive;
    } else if (active == crc_) {
      found_ = ParamDamage::kStandby;
    } else {
      found_ = active == standby ? ParamDamage::kChecksum : ParamDamage::kBeyondRepair;
    }
    if (found_ == ParamDamage::kActive) active_ = standby_;
    standby_ = active_;
    crc_ = crc_of(active_);
  }

  const ParamTable<S>& table_;
  S active_;
  S standby_;
  std::uint32_t crc_;
  ParamDamage found_ = ParamDamage::kNone;
};

}  // namespace plumb
