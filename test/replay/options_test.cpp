// The command line: what each option does, and what the user is told when it cannot.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <sstream>

#include "test/replay/run_replay.h"
#include "test/replay/small_recording.h"

namespace plumb::test {
namespace {

namespace fs = std::filesystem;

class Options : public ::testing::Test {
 protected:
  std::string asl() const { return "--asl " + quoted(recording_.path()); }
  nlohmann::json summary() const { return nlohmann::json::parse(content_of(out_ / "summary.json")); }
  std::string out() const { return " --out " + quoted(out_); }

  SmallRecording recording_;
  TemporaryFolder results_;
  fs::path out_ = results_.path() / "new" / "out";
};

std::size_t lines_of(const fs::path& file) {
  const std::string text = content_of(file);
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

TEST_F(Options, WritesEveryFileAndNothingElse) {
  const ReplayResult result = run_replay(asl() + out());
  ASSERT_EQ(result.exit_code, 0) << result.error;
  EXPECT_EQ(lines_of(out_ / "states.csv"), 31U);
  EXPECT_EQ(lines_of(out_ / "timing.csv"), 31U);
  EXPECT_GT(lines_of(out_ / "features.csv"), 31U);
  const nlohmann::json json = summary();
  const auto valid = json.at("images_valid").get<std::size_t>();
  EXPECT_EQ(lines_of(out_ / "trajectory.tum"), valid);
  EXPECT_EQ(lines_of(out_ / "covariance.csv"), valid + 1);
  EXPECT_EQ(lines_of(out_ / "trajectory_imu.tum"), json.at("predicted_states").get<std::size_t>());
  EXPECT_EQ(std::distance(fs::directory_iterator(out_), {}), 7);
  EXPECT_EQ(json.at("images_processed"), 30);
  EXPECT_EQ(json.at("counters").at("estimator").at("ranges"), 30);
  if (!json.at("heap_calls").is_null()) {
    EXPECT_EQ(json.at("heap_calls").at("estimator"), 0);
    EXPECT_EQ(json.at("heap_calls").at("fsw_without_tracker"), 0);
    EXPECT_EQ(json.at("heap_calls").at("tracker"), 0);
  }
}

TEST_F(Options, ParametersWinOverTheRecording) {
  const fs::path file = results_.write("p.yaml", "imu.gyro_noise_density: 5e-4\nrange:\n  gate_sigma: 3.5\n");
  ASSERT_EQ(run_replay(asl() + out() + " --params " + quoted(file)).exit_code, 0);
  EXPECT_EQ(summary().at("parameters").at("imu.gyro_noise_density"), 5e-4);
  EXPECT_EQ(summary().at("parameters").at("range.gate_sigma"), 3.5);
  EXPECT_EQ(summary().at("parameters").at("imu.accel_noise_density"), 2e-3);  // from the recording
}

TEST_F(Options, NoRangeLeavesTheRangeFinderOut) {
  ASSERT_EQ(run_replay(asl() + out() + " --no-range").exit_code, 0);
  EXPECT_EQ(summary().at("counters").at("estimator").at("ranges"), 0);
  EXPECT_EQ(summary().at("parameters").at("range.enabled"), 0.0);
}

TEST_F(Options, StartFromTruthHasAStateFromTheBeginning) {
  ASSERT_EQ(run_replay(asl() + out() + " --start-from-truth --config paper").exit_code, 0);
  EXPECT_EQ(summary().at("images_valid"), 30);
  EXPECT_EQ(summary().at("configuration"), "paper");
  const std::string trajectory = content_of(out_ / "trajectory.tum");
  std::istringstream first(trajectory.substr(0, trajectory.find('\n')));
  std::string time;
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  first >> time >> x >> y >> z;
  EXPECT_EQ(time, "1000.000000000");
  EXPECT_NEAR(x, 1.0, 0.01);
  EXPECT_NEAR(y, 2.0, 0.01);
  EXPECT_NEAR(z, 3.0, 0.01);
}

TEST_F(Options, RealtimeTakesAsLongAsTheRecording) {
  const auto started = std::chrono::steady_clock::now();
  ASSERT_EQ(run_replay(asl() + " --realtime").exit_code, 0);
  EXPECT_GE(std::chrono::steady_clock::now() - started, std::chrono::milliseconds(1550));
}

TEST_F(Options, InterruptLeavesNothingHalfWritten) {
  const fs::path log = results_.path() / "log.lcm";
  for (const std::string signal : {"INT", "TERM", "HUP"}) {
    SCOPED_TRACE(signal);
    // The shell becomes the program, so its own process number is the one to interrupt.
    const ReplayResult result = run_replay(asl() + out() + " --realtime --record " + quoted(log),
                                           "(sleep 0.7; kill -" + signal + " $$) & exec ");
    EXPECT_EQ(result.exit_code, 130) << result.error;
    EXPECT_NE(result.error.find("interrupted"), std::string::npos);
    EXPECT_FALSE(fs::exists(log));
    EXPECT_TRUE(fs::is_empty(out_));
    EXPECT_EQ(std::distance(fs::directory_iterator(results_.path()), {}), 1);  // the folder of the empty out_
  }
}

TEST_F(Options, InterruptIsHeardWhileTheRecordingIsSilent) {
  // A last sample an hour later: played as fast as it was recorded, nothing happens until then.
  const std::string imu = "mav0/imu0/data.csv";
  recording_.write(imu, recording_.content(imu) + "4600000000000,0,0,0,0,0,-9.80665\n");
  const auto started = std::chrono::steady_clock::now();
  const ReplayResult result = run_replay(asl() + " --realtime", "(sleep 3; kill -INT $$) & exec ");
  EXPECT_EQ(result.exit_code, 130) << result.error;
  EXPECT_LT(std::chrono::steady_clock::now() - started, std::chrono::seconds(30));
}

// The shell's limit on the size of a file stands for a disk that is full; without the trap its signal would end the
// program before it can say anything.
TEST_F(Options, AFullDiskLeavesNothingHalfWritten) {
  const std::string limit = "trap '' XFSZ; ulimit -f 8; ";  // blocks of 512 or 1024 bytes, as the shell has it
  const fs::path log = results_.path() / "log.lcm";
  const ReplayResult outputs = run_replay(asl() + out(), limit);
  EXPECT_EQ(outputs.exit_code, 1) << outputs.error;
  EXPECT_NE(outputs.error.find(out_.string() + "/"), std::string::npos) << outputs.error;
  EXPECT_NE(outputs.error.find("writing failed; is the disk full?"), std::string::npos) << outputs.error;
  EXPECT_TRUE(fs::is_empty(out_));
  const ReplayResult record = run_replay(asl() + " --record " + quoted(log), limit);
  EXPECT_EQ(record.exit_code, 1) << record.error;
  EXPECT_NE(record.error.find(log.string() + ": writing failed"), std::string::npos) << record.error;
  EXPECT_EQ(std::distance(fs::directory_iterator(results_.path()), {}), 1);
}

TEST_F(Options, TellsWhenTheTableCannotBePrinted) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  const std::string printed_nowhere = "exec 3>/dev/full; printed() { \"$@\" >&3; }; printed ";
  for (const std::string& arguments : {asl() + out(), std::string("--list-params")}) {
    SCOPED_TRACE(arguments);
    const ReplayResult result = run_replay(arguments, printed_nowhere);
    EXPECT_EQ(result.exit_code, 1) << result.error;
    EXPECT_NE(result.error.find("standard output: writing failed"), std::string::npos) << result.error;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(out_), {}), 7);  // what was flown is there all the same
}

TEST_F(Options, AFailureLeavesEarlierResultsAsTheyWere) {
  ASSERT_EQ(run_replay(asl() + out()).exit_code, 0);
  const std::string before = content_of(out_ / "states.csv");
  recording_.write(SmallRecording::image_name(20), "no picture");
  EXPECT_EQ(run_replay(asl() + out()).exit_code, 2);
  EXPECT_EQ(content_of(out_ / "states.csv"), before);
  EXPECT_EQ(std::distance(fs::directory_iterator(out_), {}), 7);
}

TEST_F(Options, NothingIsWrittenOverWhatIsRead) {
  const fs::path log = results_.path() / "flight.lcm";
  ASSERT_EQ(run_replay(asl() + " --record " + quoted(log)).exit_code, 0);
  const fs::path parameters = results_.write("summary.json", "range.gate_sigma: 3.5\n");
  const fs::path imu = recording_.path() / "mav0/imu0/data.csv";
  const fs::path link = results_.path() / "link.lcm";
  fs::create_symlink(log, link);
  const fs::path truth = results_.path() / "truth.csv";  // a table of the recording that is a link to this
  const fs::path truth_in_recording = recording_.path() / "mav0/state_groundtruth_estimate0/data.csv";
  fs::rename(truth_in_recording, truth);
  fs::create_symlink(truth, truth_in_recording);
  struct Case {
    std::string arguments;
    fs::path input;
  };
  const Case cases[] = {
      {asl() + " --record " + quoted(imu), imu},
      {asl() + " --record " + quoted(recording_.path() / "mav0/cam0/../imu0/data.csv"), imu},
      {asl() + " --record " + quoted(recording_.path() / "mav0/cam0/new"), imu},
      {asl() + " --record " + quoted(truth), truth},
      {"--log " + quoted(log) + " --record " + quoted(log), log},
      {"--log " + quoted(link) + " --record " + quoted(log), log},
      {"--log " + quoted(log) + " --record " + quoted(link), log},
      {asl() + " --params " + quoted(parameters) + " --out " + quoted(results_.path()), parameters},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.arguments);
    const std::string before = content_of(c.input);
    const ReplayResult result = run_replay(c.arguments);
    EXPECT_EQ(result.exit_code, 2) << result.error;
    EXPECT_NE(result.error.find("would be written over what is read"), std::string::npos) << result.error;
    EXPECT_EQ(content_of(c.input), before);
  }
}

TEST_F(Options, TellsWhenNobodyTakesTheMessages) {
  const ReplayResult result = run_replay(asl() + " --lcm 'tcpq://127.0.0.1:1'");
  EXPECT_EQ(result.exit_code, 1) << result.error;
  EXPECT_NE(result.error.find("tcpq://127.0.0.1:1: "), std::string::npos) << result.error;
}

TEST_F(Options, ListsEveryParameter) {
  const ReplayResult result = run_replay("--list-params");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_NE(result.out.find("range.gate_sigma"), std::string::npos);
  EXPECT_NE(result.out.find("tracker.window"), std::string::npos);
}

TEST_F(Options, HelpsAndRefusesWhatItDoesNotKnow) {
  EXPECT_EQ(run_replay("--help").exit_code, 0);
  struct Case {
    std::string arguments;
    const char* message;
  };
  const fs::path wrong = results_.write("p.yaml", "range.gate_sigma: 1000\n");
  const fs::path odd = results_.write("q.yaml", "range.min_range: 50\n");
  const Case cases[] = {
      {"", "either --asl DIR or --log FILE"},
      {asl() + " --log x.lcm", "either --asl DIR or --log FILE"},
      {asl() + " --config huge", "huge not in"},
      {asl() + " --nonsense", "--nonsense"},
      {asl() + " --out ''", "--out: expected a name"},
      {asl() + " --params /nowhere.yaml", "/nowhere.yaml: not found"},
      {asl() + " --params " + quoted(wrong), "refused for range.gate_sigma; expected from 1.5 to 100, found '1000'"},
      {asl() + " --params " + quoted(odd), "q.yaml: range.min_range must be below range.max_range"},
      {asl() + " --out /dev/null/x", "/dev/null"},
      {asl() + " --record /proc/no_folder/x.lcm", "/proc/no_folder"},
      {asl() + " --out " + quoted(out_) + " --record " + quoted(out_ / "states.csv"), "is being written already"},
      {asl() + " --lcm 'file:///tmp/x.lcm?mode=w'", "is a file; expected a network (--record logs)"},
      {asl() + " --params " + quoted(results_.path()), ": not a file; expected a YAML file"},
      {asl() + " --lcm nonsense://x", "LCM cannot use 'nonsense://x'"},
      {"--asl /nowhere", "/nowhere: not a folder"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.arguments);
    const ReplayResult result = run_replay(c.arguments);
    EXPECT_EQ(result.exit_code, 2) << result.error;
    EXPECT_NE(result.error.find(c.message), std::string::npos) << result.error;
  }
}

TEST_F(Options, StartFromTruthNeedsTruth) {
  fs::remove_all(recording_.path() / "mav0/state_groundtruth_estimate0");
  const ReplayResult result = run_replay(asl() + " --start-from-truth");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.error.find("--start-from-truth needs a recording with truth"), std::string::npos) << result.error;
  recording_.write("mav0/state_groundtruth_estimate0/data.csv", "1000100000000,1,2,3,0,1,0,0,0,0,0\n");
  const ReplayResult late = run_replay(asl() + " --start-from-truth");
  EXPECT_EQ(late.exit_code, 2);
  EXPECT_NE(late.error.find("needs truth within 50 ms of the first image"), std::string::npos) << late.error;
}

}  // namespace
}  // namespace plumb::test
