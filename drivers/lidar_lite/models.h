#pragma once
// The members of the Garmin LIDAR-Lite family that Plumb reads, one table each, and how their registers become a range.
//
// Sources: LIDAR-Lite v3, v3HP and LIDAR-Lite v4 LED operation manuals ("Control register list"); Garmin's Arduino
// library e2d43ad (LIDARLite.cpp, _v3HP, _v4LED) for the presets; PX4 ll40ls for the signal threshold of the v3 and the
// telling apart of v3 and v3HP.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "fsw/base/fixed_vector.h"
#include "fsw/measurement/samples.h"

namespace plumb::lidar_lite {

inline constexpr std::uint8_t kAddress = 0x62;  ///< 7 bits, all models
inline constexpr std::uint8_t kRegisterCommand = 0x00;
inline constexpr std::uint8_t kRegisterStatus = 0x01;
inline constexpr std::uint8_t kCommandReset = 0x00;
inline constexpr std::uint8_t kStatusBusy = 0x01;

enum class Model : std::uint8_t { kV3 = 0, kV3Hp, kV4Led };

struct RegisterValue {
  std::uint8_t address;
  std::uint8_t value;
};

inline constexpr std::size_t kMaxPreset = 4;

struct ModelTable {
  /// Garmin's preset "balanced", written after each reset; the first of it is read back.
  FixedVector<RegisterValue, kMaxPreset> preset;
  /// Tells the model from the others at the same address. A v4 LED passes for a v3HP here; it fails at the preset,
  /// whose registers it does not have.
  std::uint8_t identity_register = 0;
  bool (*is_identity)(std::uint8_t value) = nullptr;
  std::uint8_t command_plain = 0;  ///< measure
  std::uint8_t command_bias = 0;   ///< measure with correction of the receiver's bias
  std::uint8_t distance_register = 0;
  bool distance_high_first = false;
  bool has_strength = false;
  std::uint8_t strength_register = 0;
  std::uint8_t max_weak_strength = 0;     ///< a return this strong or weaker is no good
  std::uint8_t status_no_return = 0;      ///< bits that say that no peak was found
  std::uint8_t status_must_be_set = 0;    ///< bits without which a measurement is not to be trusted
  std::uint8_t status_must_be_clear = 0;  ///< bits with which it is not
  std::uint16_t max_range_cm = 0;         ///< to a target of 70 % reflectivity (v4 LED: 90 %)
};

const ModelTable& table_of(Model model);

/// What the device says after a measurement.
struct Reading {
  std::uint8_t status = 0;
  std::array<std::uint8_t, 2> distance{};  ///< in the order of the registers
  std::uint8_t strength = 0;
};

enum class Verdict : std::uint8_t {
  kRange = 0,
  kNoReturn,   ///< no peak, 1 cm or less (which is how no return is told), or outside 5 cm to the model's reach
  kWeak,       ///< too weak a signal, or the device says that it is not well
  kNoReading,  ///< the top bit of the distance: the registers were not ready
};

struct Interpreted {
  Verdict verdict = Verdict::kNoReading;
  std::uint16_t distance_cm = 0;
};

Interpreted interpret(const ModelTable& table, const Reading& reading);

/// The sample of a reading; precondition: not Verdict::kNoReading. `t` is the middle of the acquisition.
RangeSample to_sample(const Interpreted& interpreted, Time t);

}  // namespace plumb::lidar_lite
