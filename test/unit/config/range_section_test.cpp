#include "config/range_section.h"

#include <gtest/gtest.h>

#include "drivers/can_range/decoder.h"
#include "test/emulators/can_range/can_range_encoder.h"
#include "test/unit/config/sound_config.h"

namespace plumb {
namespace {

using test::faults_of;
using test::names;
using test::with;

TEST(RangeSection, RefusesANodeIdThatCannotBeItsOwn) {
  for (const char* bad : {"0", "128", "-1", "21.5", "42"}) {
    const std::vector<std::string> faults = faults_of(with("own_node_id: 21", std::string("own_node_id: ") + bad));
    EXPECT_TRUE(names(faults, "'range.own_node_id'")) << bad;
  }
}

/// The sound file with a Benewake, and further keys of its section.
std::string with_benewake(const std::string& keys) {
  return with("node_id: 42\n  own_node_id: 21\n", "protocol: benewake\n" + keys);
}

// Range finders on one bus are told apart by what the file says, whichever way they speak.
TEST(RangeSection, ABenewakeIsHeardUnderTheIdentifierThatTheFileGives) {
  constexpr Time kNow = Time::from_ns(1'000'000'000);
  const auto hears = [&](const std::string& keys, unsigned distance_cm, unsigned strength) {
    std::vector<std::string> faults;
    const can_range::Options options = read_flight_config("flight.yaml", with_benewake(keys), faults).range.can;
    EXPECT_EQ(faults, std::vector<std::string>{}) << keys;
    can_range::Decoder decoder(options);
    CanFrame frame = test::benewake_frame(distance_cm, strength);
    frame.id = 0x123;
    const CanFilter filter = decoder.filter();
    const Result<can_range::Reading> reading = decoder.decode({kNow, frame});
    EXPECT_EQ((frame.id & filter.mask) == (filter.id & filter.mask), static_cast<bool>(reading)) << keys;
    return reading;
  };
  EXPECT_EQ(hears("", 1234, 500).status(), Status::kNotReady);
  const auto quality = [&](const std::string& keys, unsigned distance_cm, unsigned strength) {
    const Result<can_range::Reading> reading = hears("  can_id: 291\n" + keys, distance_cm, strength);
    EXPECT_TRUE(reading) << keys;
    return reading ? reading->sample.quality : RangeQuality::kNoReturn;
  };
  EXPECT_EQ(quality("", 1234, 500), RangeQuality::kValid);
  EXPECT_EQ(quality("  min_strength: 501\n", 1234, 500), RangeQuality::kWeak);
  EXPECT_EQ(quality("  min_strength: 500\n", 1234, 500), RangeQuality::kValid);
  EXPECT_EQ(quality("  far_cm: 1234\n", 1234, 500), RangeQuality::kNoReturn);
  EXPECT_EQ(quality("  far_cm: 1235\n", 1234, 500), RangeQuality::kValid);
}

TEST(RangeSection, ANodeIsHeardAsTheFileSays) {
  std::vector<std::string> faults;
  const can_range::Options options =
      read_flight_config("flight.yaml", with("node_id: 42", "node_id: 42\n  sensor_id: 3"), faults).range.can;
  EXPECT_EQ(faults, std::vector<std::string>{});
  for (const auto& [node, sensor] : {std::pair{42U, 3U}, {42U, 2U}, {41U, 3U}}) {
    can_range::Decoder decoder(options);
    bool heard = false;
    for (const CanFrame& frame : test::measurement_frames({.node_id = node, .sensor_id = sensor}, 12.5, 1, 0)) {
      heard = decoder.decode({Time::from_ns(1'000'000'000), frame}) || heard;
    }
    EXPECT_EQ(heard, node == 42 && sensor == 3) << node << " " << sensor;
  }
}

TEST(RangeSection, RefusesValuesThatNoBenewakeHas) {
  for (const char* bad : {"can_id: -1", "can_id: 2048", "can_id: 3.5", "can_id: three", "far_cm: 1", "far_cm: 65536",
                          "far_cm: 180.5", "min_strength: -1", "min_strength: 65536", "min_strength: 0.5"}) {
    const std::string key(bad, std::string(bad).find(':'));
    const std::vector<std::string> faults = faults_of(with_benewake("  " + std::string(bad) + "\n"));
    EXPECT_EQ(faults.size(), 1U) << bad << testing::PrintToString(faults);
    EXPECT_TRUE(names(faults, "flight.yaml line 24: key 'range." + key + "': expected ")) << bad;
  }
  EXPECT_EQ(faults_of(with_benewake("  can_id: 2048\n")),
            std::vector<std::string>{"flight.yaml line 24: key 'range.can_id': expected 0 to 2047, found '2048'"});
}

TEST(RangeSection, RefusesKeysOfTheOtherProtocol) {
  for (const char* key : {"node_id", "sensor_id", "own_node_id"}) {
    EXPECT_EQ(faults_of(with_benewake("  " + std::string(key) + ": 7\n")),
              std::vector<std::string>{"flight.yaml line 24: key 'range." + std::string(key) +
                                       "': stands beside protocol: benewake; expected only beside protocol: dronecan, "
                                       "found '7'"});
  }
  for (const char* key : {"can_id", "far_cm", "min_strength"}) {
    for (const char* protocol : {"", "  protocol: dronecan\n"}) {
      const std::vector<std::string> faults =
          faults_of(with("  own_node_id: 21\n", std::string(protocol) + "  " + key + ": 7\n"));
      EXPECT_EQ(faults.size(), 1U) << testing::PrintToString(faults);
      EXPECT_TRUE(names(faults, "key 'range." + std::string(key) +
                                    "': stands beside protocol: dronecan; expected only beside protocol: benewake"));
    }
    // Which of them is right nobody can say beside a protocol that is none.
    EXPECT_EQ(faults_of(with("own_node_id: 21", std::string("protocol: foo\n  ") + key + ": 7")).size(), 1U);
  }
}

TEST(RangeSection, TwoRangeFindersHideNoFaultOfEither) {
  const std::vector<std::string> faults =
      faults_of(with("own_node_id: 21", "own_node_id: 0\n  i2c: /dev/i2c-1\n  period_ms: 5\n  latency_ms: -1"));
  for (const char* what : {"expected either i2c or can", "'range.own_node_id': expected 1 to 127",
                           "'range.latency_ms': expected 0 to 1000", "'range.period_ms': expected at least 10 ms"}) {
    EXPECT_TRUE(names(faults, what)) << what;
  }
  EXPECT_EQ(faults.size(), 4U) << testing::PrintToString(faults);
}

}  // namespace
}  // namespace plumb
