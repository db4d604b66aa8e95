// Whatever is wrong with a log: one message, exit code 2, no output.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <vector>

#include "fsw/telemetry/messages.h"
#include "hal/linux/lcm_log.h"
#include "test/replay/run_replay.h"
#include "test/replay/small_recording.h"

namespace plumb::test {
namespace {

namespace fs = std::filesystem;

struct Event {
  std::string channel;
  std::vector<std::uint8_t> message;
};
using Log = std::vector<Event>;

Log read_log(const fs::path& file) {
  std::string error;
  const std::unique_ptr<LcmLogReader> reader = LcmLogReader::open(file.string(), error);
  EXPECT_NE(reader, nullptr) << error;
  Log log;
  LogEvent event;
  while (ok(reader->next(event))) log.push_back({event.channel, {event.message.begin(), event.message.end()}});
  return log;
}

void write_log(const fs::path& file, const Log& log) {
  std::string error;
  const std::unique_ptr<LcmLogWriter> writer = LcmLogWriter::open(file.string(), error);
  ASSERT_NE(writer, nullptr) << error;
  for (const Event& event : log) {
    ASSERT_EQ(writer->write(event.channel.c_str(), Time::from_ns(0), event.message), Status::kOk);
  }
}

Event& first(Log& log, const std::string& channel) {
  return *std::find_if(log.begin(), log.end(), [&](const Event& event) { return event.channel == channel; });
}

void remove_all(Log& log, const std::string& channel) {
  std::erase_if(log, [&](const Event& event) { return event.channel == channel; });
}

struct BadCase {
  const char* name;
  std::function<void(Log&)> spoil;
  const char* message;
};

const BadCase kCases[] = {
    {"empty", [](Log& log) { log.clear(); }, "holds no INPUT_FRAME with an image"},
    {"no calibration", [](Log& log) { remove_all(log, "CALIBRATION"); }, "expected CALIBRATION and PARAMS before"},
    {"no parameters", [](Log& log) { remove_all(log, "PARAMS"); }, "expected CALIBRATION and PARAMS before"},
    {"no pictures", [](Log& log) { remove_all(log, "CAMERA"); }, "channel CAMERA: image 0 is not before"},
    {"no inputs", [](Log& log) { remove_all(log, "INPUT_FRAME"); }, "holds no INPUT_FRAME with an image"},
    {"broken calibration", [](Log& log) { first(log, "CALIBRATION").message.pop_back(); }, "channel CALIBRATION: not"},
    {"broken parameters", [](Log& log) { first(log, "PARAMS").message[3] ^= 1U; }, "channel PARAMS: not a params_t"},
    {"unknown parameter",
     [](Log& log) {
       std::vector<std::uint8_t>& message = first(log, "PARAMS").message;
       message[8 + 16 + 4] = 'x';  // first letter of the first name, after fingerprint, configuration and count
     },
     "no parameter has this name"},
    {"broken picture", [](Log& log) { first(log, "CAMERA").message.pop_back(); },
     "channel CAMERA: not a valid image_t"},
    {"broken input", [](Log& log) { first(log, "INPUT_FRAME").message.clear(); }, "channel INPUT_FRAME: not a valid"},
    {"broken truth", [](Log& log) { first(log, "TRUTH").message.clear(); }, "channel TRUTH: not a truth_t"},
    {"input twice", [](Log& log) { log.push_back(first(log, "INPUT_FRAME")); }, "is not after the one before"},
    {"picture of another size",
     [](Log& log) {
       const std::vector<std::uint8_t> pixels(95 * 64);
       const CameraFrame frame{.t_exposure_mid = Time::from_ns(SmallRecording::kStart_ns),
                               .sequence = 0,
                               .image = {.pixels = pixels.data(), .width = 95, .height = 64, .stride = 95}};
       std::vector<std::uint8_t>& message = first(log, "CAMERA").message;
       message.resize(kImageHeaderBytes + pixels.size());
       ASSERT_TRUE(encode(frame, message).has_value());
     },
     "channel CAMERA: image 0 is 95 x 64 px; expected the resolution of CALIBRATION, 96 x 64"},
};

/// A flight that was recorded as a log.
class BadLog : public ::testing::Test {
 protected:
  BadLog() {
    const SmallRecording recording;
    EXPECT_EQ(run_replay("--asl " + quoted(recording.path()) + " --record " + quoted(log_)).exit_code, 0);
  }

  TemporaryFolder results_;
  fs::path log_ = results_.path() / "flight.lcm";
};

TEST_F(BadLog, IsToldInOneMessageAndLeavesNothing) {
  const Log whole = read_log(log_);
  for (const BadCase& c : kCases) {
    SCOPED_TRACE(c.name);
    Log log = whole;
    c.spoil(log);
    const fs::path bad = results_.path() / "bad.lcm";
    const fs::path out = results_.path() / "out";
    write_log(bad, log);
    const ReplayResult result = run_replay("--log " + quoted(bad) + " --out " + quoted(out));
    EXPECT_EQ(result.exit_code, 2) << result.error;
    EXPECT_NE(result.error.find(c.message), std::string::npos) << result.error;
    EXPECT_NE(result.error.find("plumb-replay: " + bad.string()), std::string::npos) << result.error;
    EXPECT_TRUE(!fs::exists(out) || fs::is_empty(out));
  }
}

// What is left of a flight whose process was killed is flown, and compared as far as it goes, wherever it ends.
TEST_F(BadLog, FliesALogThatIsCutShortUpToThere) {
  const auto size = fs::file_size(log_);
  for (const std::uintmax_t missing : {std::uintmax_t{1}, std::uintmax_t{100}, size / 7}) {
    fs::resize_file(log_, size - missing);
    const ReplayResult cut_short = run_replay("--log " + quoted(log_));
    EXPECT_EQ(cut_short.exit_code, 0) << cut_short.error;
    EXPECT_NE(cut_short.error.find("is cut short after byte"), std::string::npos) << cut_short.error;
  }
}

TEST_F(BadLog, TellsALogThatIsDamagedOrNone) {
  const auto middle = static_cast<std::streamoff>(fs::file_size(log_) / 2);
  {
    std::fstream file(log_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(middle);
    file << std::string(20000, 'x');  // more than one event
  }
  const ReplayResult damaged = run_replay("--log " + quoted(log_));
  EXPECT_EQ(damaged.exit_code, 2);
  EXPECT_EQ(damaged.error.find("is cut short"), std::string::npos) << damaged.error;
  const ReplayResult none = run_replay("--log " + quoted(results_.write("text.txt", "this is no log")));
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_EQ(run_replay("--log " + quoted(results_.path() / "missing.lcm")).exit_code, 2);
}

// As after a disk that kept plumb-fsw's log waiting for more than a second. Not a bad log at all.
TEST_F(BadLog, ManyImagesMayStandBeforeTheFramesThatReferToThem) {
  Log log = read_log(log_);
  const auto is_early = [](const Event& event) {
    return event.channel == "CALIBRATION" || event.channel == "PARAMS" || event.channel == "CAMERA";
  };
  std::stable_partition(log.begin(), log.end(), is_early);
  const fs::path early = results_.path() / "early.lcm";
  write_log(early, log);
  const ReplayResult result = run_replay("--log " + quoted(early));
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_NE(result.out.find(", all equal"), std::string::npos) << result.out;
}

// Other pixels give other states. Only who changes the flight himself may expect that.
TEST_F(BadLog, TellsAFlightThatIsNotTheOneRecorded) {
  Log altered = read_log(log_);
  for (Event& event : altered) {
    if (event.channel == "CAMERA") std::fill(event.message.begin() + kImageHeaderBytes, event.message.end(), 7);
  }
  write_log(log_, altered);
  const ReplayResult result = run_replay("--log " + quoted(log_));
  EXPECT_EQ(result.exit_code, 3) << result.error;
  EXPECT_NE(result.error.find("states differ from the recorded ones, first at image"), std::string::npos)
      << result.error;
  EXPECT_EQ(run_replay("--log " + quoted(log_) + " --no-range").exit_code, 0);
}

TEST_F(BadLog, TellsWhenRecordedImagesDoNotComeAgain) {
  Log shorter = read_log(log_);
  const auto last_input = std::find_if(shorter.rbegin(), shorter.rend(), [](const Event& event) {
    InputFrame input;
    return event.channel == "INPUT_FRAME" && ok(decode(event.message, input)) && input.has_camera;
  });
  shorter.erase(std::next(last_input).base());
  write_log(log_, shorter);
  const ReplayResult result = run_replay("--log " + quoted(log_));
  EXPECT_EQ(result.exit_code, 3) << result.error;
  EXPECT_NE(result.error.find("1 of 30 states differ from the recorded ones, first at image 29"), std::string::npos)
      << result.error;
}

}  // namespace
}  // namespace plumb::test
