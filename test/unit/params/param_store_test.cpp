#include "fsw/params/param_store.h"

#include <gtest/gtest.h>

#include "test/support/param_store_seam.h"
#include "test/support/property.h"

namespace plumb {
namespace {

struct Options {
  double gain = 2.0;
  double limit = 5.0;
  int count = 3;
  bool operator==(const Options&) const = default;
};

constexpr std::array kRows{
    param<Options, &Options::gain>("gain", "m", 0.5, 10.0, "a real"),
    param<Options, &Options::limit>("limit", "m", -100.0, 100.0, "another"),
    param<Options, &Options::count>("count", "1", 0, 5, "a whole number"),
};
constexpr ParamTable<Options> kTable{kRows};

using Store = ParamStore<Options>;

/// One of the two reals with one bit wrong.
void damage(Options& options, test::Generator& g) {
  double& value = g.integer(0, 1) == 0 ? options.gain : options.limit;
  value = test::with_bit_flipped(value, static_cast<unsigned>(g.integer(0, 63)));
}

TEST(ParamStore, AChangeIsInForceAndIsNoDamage) {
  Store store(kTable, {});
  store.set(kRows[2], 5.0);
  store.set(kRows[0], 0.5);
  EXPECT_EQ(store.active(), (Options{.gain = 0.5, .count = 5}));
  EXPECT_EQ(store.check(), ParamDamage::kNone);
  EXPECT_EQ(store.active(), (Options{.gain = 0.5, .count = 5}));
}

TEST(ParamStore, AValueThatItsRowDoesNotTakeIsABug) {
  Store store(kTable, {});
  EXPECT_DEATH(store.set(kRows[2], 6.0), "");
}

// Whatever was set before, any one bit that fails anywhere is found once, and the values are those that were set.
TEST(ParamStoreLaws, AnyBitThatFailsIsToldOnceAndMended) {
  test::for_all(300, [](test::Generator& g) {
    Store store(kTable, {});
    store.set(kRows[1], g.uniform(-100.0, 100.0));
    const Options before = store.active();
    const std::int64_t where = g.integer(0, 2);
    ParamDamage expected = ParamDamage::kChecksum;
    if (where == 0) {
      damage(ParamStoreSeam::active(store), g);
      expected = ParamDamage::kActive;
    } else if (where == 1) {
      damage(ParamStoreSeam::standby(store), g);
      expected = ParamDamage::kStandby;
    } else {
      ParamStoreSeam::checksum(store) ^= 1U << static_cast<unsigned>(g.integer(0, 31));
    }
    EXPECT_EQ(store.check(), expected);
    EXPECT_EQ(store.active(), before);
    EXPECT_EQ(store.check(), ParamDamage::kNone);
  });
}

// A change that comes before the next look must not put the damage under a new CRC.
TEST(ParamStoreLaws, AChangeMendsAndTellsWhatFailedBeforeIt) {
  test::for_all(300, [](test::Generator& g) {
    Store store(kTable, {});
    const bool active = g.integer(0, 1) == 0;
    damage(active ? ParamStoreSeam::active(store) : ParamStoreSeam::standby(store), g);
    store.set(kRows[2], 1.0);
    EXPECT_EQ(store.active(), (Options{.count = 1}));
    EXPECT_EQ(store.check(), active ? ParamDamage::kActive : ParamDamage::kStandby);
    EXPECT_EQ(store.check(), ParamDamage::kNone);
  });
}

TEST(ParamStore, WhereNoTwoAgreeThatIsTold) {
  Store store(kTable, {});
  ParamStoreSeam::active(store).gain = 3.0;
  ParamStoreSeam::standby(store).gain = 4.0;
  EXPECT_EQ(store.check(), ParamDamage::kBeyondRepair);
  EXPECT_EQ(store.active().gain, 3.0) << "what is in force stays";
  EXPECT_EQ(store.check(), ParamDamage::kNone);
}

TEST(ParamTable, ItsChecksumTellsOrderAndNames) {
  constexpr std::array kSwapped{kRows[1], kRows[0], kRows[2]};
  constexpr std::array kRunTogether{
      param<Options, &Options::gain>("gainl", "m", 0.5, 10.0, "a real"),
      param<Options, &Options::limit>("imit", "m", -100.0, 100.0, "another"),
      kRows[2],
  };
  EXPECT_EQ(kTable.crc(), ParamTable<Options>(kRows).crc());
  EXPECT_NE(kTable.crc(), ParamTable<Options>(kSwapped).crc());
  EXPECT_NE(kTable.crc(), ParamTable<Options>(kRunTogether).crc());
  constexpr std::array<std::uint8_t, 17> kNames{'g', 'a', 'i', 'n', 0,   'l', 'i', 'm', 'i',
                                                't', 0,   'c', 'o', 'u', 'n', 't', 0};
  EXPECT_EQ(kTable.crc(), crc32(kNames));
}

}  // namespace
}  // namespace plumb
