// The same input gives the same bits: run twice, and recorded and flown from the record.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "test/replay/run_replay.h"
#include "test/replay/small_recording.h"
#include "test/support/data.h"

namespace plumb::test {
namespace {

namespace fs = std::filesystem;

nlohmann::json summary_in(const fs::path& folder) { return nlohmann::json::parse(content_of(folder / "summary.json")); }

// Every row of states.csv ends with the hash of state and covariance, so equal files are equal hashes in every frame.
void expect_same_bits(const fs::path& a, const fs::path& b) {
  for (const char* file : {"states.csv", "covariance.csv", "trajectory.tum", "trajectory_imu.tum"}) {
    EXPECT_FALSE(content_of(a / file).empty()) << file;
    EXPECT_EQ(content_of(a / file) == content_of(b / file), true) << file << " differs";
  }
  EXPECT_EQ(summary_in(a).at("run_hash"), summary_in(b).at("run_hash"));
}

void expect_repeatable(const fs::path& recording, const std::string& options) {
  const TemporaryFolder results;
  const fs::path first = results.path() / "first";
  const fs::path second = results.path() / "second";
  const fs::path replayed = results.path() / "replayed";
  const fs::path log = results.path() / "flight.lcm";
  const std::string asl = "--asl " + quoted(recording) + " " + options;
  const ReplayResult recorded = run_replay(asl + " --record " + quoted(log) + " --out " + quoted(first));
  ASSERT_EQ(recorded.exit_code, 0) << recorded.error;
  ASSERT_EQ(run_replay(asl + " --out " + quoted(second)).exit_code, 0);
  expect_same_bits(first, second);

  const std::string start = options.find("--start-from-truth") == std::string::npos ? "" : " --start-from-truth";
  const ReplayResult from_log = run_replay("--log " + quoted(log) + start + " --out " + quoted(replayed));
  ASSERT_EQ(from_log.exit_code, 0) << from_log.error;
  expect_same_bits(first, replayed);
  const nlohmann::json json = summary_in(replayed);
  EXPECT_EQ(json.at("configuration"), summary_in(first).at("configuration"));
  EXPECT_EQ(json.at("recorded_hashes").at("recorded"), json.at("images_processed"));
  EXPECT_EQ(json.at("recorded_hashes").at("different"), 0);
}

TEST(Determinism, SmallRecording) { expect_repeatable(SmallRecording().path(), ""); }
TEST(Determinism, SmallRecordingInThePaperConfiguration) {
  expect_repeatable(SmallRecording().path(), "--config paper --no-range");
}
TEST(Determinism, SmallRecordingFromTruth) { expect_repeatable(SmallRecording().path(), "--start-from-truth"); }

// A recording cut to its first images, without copying them.
void cut(const fs::path& from, const fs::path& to, std::size_t images) {
  fs::create_directories(to / "mav0/cam0");
  for (const char* folder : {"imu0", "range0", "state_groundtruth_estimate0"}) {
    if (fs::exists(from / "mav0" / folder)) fs::create_directory_symlink(from / "mav0" / folder, to / "mav0" / folder);
  }
  fs::create_symlink(from / "mav0/cam0/sensor.yaml", to / "mav0/cam0/sensor.yaml");
  fs::create_directory_symlink(from / "mav0/cam0/data", to / "mav0/cam0/data");
  std::ifstream table(from / "mav0/cam0/data.csv");
  std::ofstream shorter(to / "mav0/cam0/data.csv");
  std::string line;
  for (std::size_t row = 0; row <= images && std::getline(table, line); ++row) shorter << line << "\n";
}

TEST(Determinism, RealFlight) {
  const auto data = data_folder("euroc_mh01");
  if (!data) GTEST_SKIP() << kNoData;
  const TemporaryFolder folder;
  cut(fs::canonical(*data), folder.path(), 200);
  expect_repeatable(folder.path(), "");
}

TEST(Determinism, RealFlightIsCoveredWithoutHeap) {
  const auto data = data_folder("euroc_mh01");
  if (!data) GTEST_SKIP() << kNoData;
  const TemporaryFolder results;
  const ReplayResult result = run_replay("--asl " + quoted(*data) + " --out " + quoted(results.path()));
  ASSERT_EQ(result.exit_code, 0) << result.error;
  const nlohmann::json json = summary_in(results.path());
  EXPECT_EQ(json.at("images_processed"), 600);
  EXPECT_GE(json.at("coverage").get<double>(), 0.95);
  EXPECT_EQ(json.at("counters").at("estimator").at("resets"), 0);
  EXPECT_EQ(json.at("counters").at("predictor").at("stale_corrections"), 0);
  if (json.at("heap_calls").is_null()) return;
  EXPECT_EQ(json.at("heap_calls").at("estimator"), 0);
  EXPECT_EQ(json.at("heap_calls").at("fsw_without_tracker"), 0);
  EXPECT_EQ(json.at("heap_calls").at("tracker"), 0);
}

}  // namespace
}  // namespace plumb::test
