#include "drivers/lidar_lite/models.h"

namespace plumb::lidar_lite {
namespace {

constexpr std::uint16_t kMinRange_cm = 5;  // all manuals: range from 5 cm
constexpr std::uint16_t kNotReadyBit = 0x8000;
constexpr double kMetresPerCm = 0.01;

template <std::size_t N>
constexpr FixedVector<RegisterValue, kMaxPreset> preset(const std::array<RegisterValue, N>& values) {
  FixedVector<RegisterValue, kMaxPreset> registers;
  for (const RegisterValue& value : values) (void)registers.push_back(value);  // N <= kMaxPreset, asserted below
  static_assert(N <= kMaxPreset);
  return registers;
}

// SIG_COUNT_VAL, ACQ_CONFIG_REG, THRESHOLD_BYPASS; 0x41 is the hardware version, 0 on the v3HP. Status bit 3: no peak;
// bit 5: health; bit 6: process error.
constexpr ModelTable kV3{
    .preset = preset<3>({{{0x02, 0x80}, {0x04, 0x08}, {0x1C, 0x00}}}),
    .identity_register = 0x41,
    .is_identity = [](std::uint8_t value) { return value != 0; },
    .command_plain = 0x03,
    .command_bias = 0x04,
    .distance_register = 0x8F,  // 0x0F with the flag for auto-increment
    .distance_high_first = true,
    .has_strength = true,
    .strength_register = 0x0E,
    .max_weak_strength = 24,
    .status_no_return = 0x08,
    .status_must_be_set = 0x20,
    .status_must_be_clear = 0x40,
    .max_range_cm = 4000,
};

// As the v3 with REF_COUNT_VAL. Auto-increment is always on. Its manual promises busy and no more of the status; bit 3
// is taken as on the v3, a health bit is not asked for. Signal strength runs from 70 to 255.
constexpr ModelTable kV3Hp{
    .preset = preset<4>({{{0x02, 0x80}, {0x04, 0x08}, {0x1C, 0x00}, {0x12, 0x05}}}),
    .identity_register = 0x41,
    .is_identity = [](std::uint8_t value) { return value == 0; },
    .command_plain = 0x01,
    .command_bias = 0x01,
    .distance_register = 0x0F,
    .distance_high_first = true,
    .has_strength = true,
    .strength_register = 0x0E,
    .max_weak_strength = 69,
    .status_no_return = 0x08,
    .status_must_be_set = 0x00,
    .status_must_be_clear = 0x00,
    .max_range_cm = 4000,
};

// ACQUISITION_COUNT and QUICK_TERMINATION; 0xE1 is the hardware revision, A or B. Status bit 5: noise bias error. There
// is no register of the signal strength.
constexpr ModelTable kV4Led{
    .preset = preset<2>({{{0x05, 0x80}, {0xE5, 0x08}}}),
    .identity_register = 0xE1,
    .is_identity = [](std::uint8_t value) { return value == 0x10 || value == 0x08; },
    .command_plain = 0x03,
    .command_bias = 0x04,
    .distance_register = 0x10,
    .distance_high_first = false,
    .has_strength = false,
    .strength_register = 0x00,
    .max_weak_strength = 0,
    .status_no_return = 0x00,
    .status_must_be_set = 0x00,
    .status_must_be_clear = 0x20,
    .max_range_cm = 1000,
};

}  // namespace

const ModelTable& table_of(Model model) {
  switch (model) {
    case Model::kV3: return kV3;
    case Model::kV3Hp: return kV3Hp;
    case Model::kV4Led: return kV4Led;
  }
  PLUMB_ASSERT(false && "no such model");
  return kV3;
}

Interpreted interpret(const ModelTable& table, const Reading& reading) {
  const std::uint8_t high = reading.distance[table.distance_high_first ? 0 : 1];
  const std::uint8_t low = reading.distance[table.distance_high_first ? 1 : 0];
  const auto distance_cm = static_cast<std::uint16_t>(high << 8U | low);
  if ((distance_cm & kNotReadyBit) != 0) return {Verdict::kNoReading, distance_cm};
  const bool outside = distance_cm < kMinRange_cm || distance_cm > table.max_range_cm;
  if ((reading.status & table.status_no_return) != 0 || outside) return {Verdict::kNoReturn, distance_cm};
  const bool unwell = (reading.status & table.status_must_be_set) != table.status_must_be_set ||
                      (reading.status & table.status_must_be_clear) != 0;
  const bool faint = table.has_strength && reading.strength <= table.max_weak_strength;
  return {unwell || faint ? Verdict::kWeak : Verdict::kRange, distance_cm};
}

RangeSample to_sample(const Interpreted& interpreted, Time t) {
  switch (interpreted.verdict) {
    case Verdict::kRange: return {t, interpreted.distance_cm * kMetresPerCm, RangeQuality::kValid};
    case Verdict::kWeak: return {t, interpreted.distance_cm * kMetresPerCm, RangeQuality::kWeak};
    case Verdict::kNoReturn: return {t, 0.0, RangeQuality::kNoReturn};
    case Verdict::kNoReading: break;
  }
  PLUMB_ASSERT(false && "a reading that was not ready is no sample");
  return {};
}

}  // namespace plumb::lidar_lite
