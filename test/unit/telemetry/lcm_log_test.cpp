#include "hal/linux/lcm_log.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <vector>

#include "fsw/telemetry/messages.h"

namespace plumb {
namespace {

namespace fs = std::filesystem;

class LcmLog : public ::testing::Test {
 protected:
  LcmLog() { fs::create_directories(folder_); }
  ~LcmLog() override { fs::remove_all(folder_); }

  std::string write_log() const {
    const std::string file = (folder_ / "flight.lcm").string();
    std::string error;
    const std::unique_ptr<LcmLogWriter> writer = LcmLogWriter::open(file, error);
    EXPECT_NE(writer, nullptr) << error;
    EXPECT_EQ(writer->write("ONE", Time::from_ns(1000), first_), Status::kOk);
    EXPECT_EQ(writer->write("TWO", Time::from_ns(2000), second_), Status::kOk);
    EXPECT_EQ(writer->flush(), Status::kOk);
    return file;
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / ("plumb_lcm_log_" + std::to_string(getpid()));
  const std::vector<std::uint8_t> first_{1, 2, 3};
  const std::vector<std::uint8_t> second_{};
};

TEST_F(LcmLog, ReadsWhatWasWritten) {
  std::string error;
  const std::unique_ptr<LcmLogReader> reader = LcmLogReader::open(write_log(), error);
  ASSERT_NE(reader, nullptr) << error;
  LogEvent event;
  ASSERT_EQ(reader->next(event), Status::kOk);
  EXPECT_EQ(event.channel, "ONE");
  EXPECT_EQ(std::vector<std::uint8_t>(event.message.begin(), event.message.end()), first_);
  ASSERT_EQ(reader->next(event), Status::kOk);
  EXPECT_EQ(event.channel, "TWO");
  EXPECT_TRUE(event.message.empty());
  EXPECT_EQ(reader->next(event), Status::kNotReady);
}

TEST_F(LcmLog, TellsALogThatIsCutShort) {
  const std::string file = write_log();
  fs::resize_file(file, fs::file_size(file) - 1);
  std::string error;
  const std::unique_ptr<LcmLogReader> reader = LcmLogReader::open(file, error);
  ASSERT_NE(reader, nullptr) << error;
  LogEvent event;
  ASSERT_EQ(reader->next(event), Status::kOk);
  EXPECT_FALSE(reader->is_cut());
  EXPECT_EQ(reader->next(event), Status::kNotReady);
  EXPECT_TRUE(reader->is_cut());
}

TEST_F(LcmLog, TellsDamageAtItsEndFromACut) {
  const std::string file = write_log();
  {
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary | std::ios::ate);
    stream << "what is no event, and longer than the head of one";
  }
  std::string error;
  const std::unique_ptr<LcmLogReader> reader = LcmLogReader::open(file, error);
  ASSERT_NE(reader, nullptr) << error;
  LogEvent event;
  ASSERT_EQ(reader->next(event), Status::kOk);
  EXPECT_EQ(reader->next(event), Status::kInvalidValue);  // LCM looks at what follows an event
  EXPECT_FALSE(reader->is_cut());
}

TEST_F(LcmLog, TellsDamageThatLcmPassesOver) {
  const std::string file = write_log();
  {
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
    stream.put('x');  // the first sync word
  }
  std::string error;
  const std::unique_ptr<LcmLogReader> reader = LcmLogReader::open(file, error);
  ASSERT_NE(reader, nullptr) << error;
  LogEvent event;
  EXPECT_EQ(reader->next(event), Status::kInvalidValue);
}

TEST_F(LcmLog, KeepsTheReasonOfTheFirstWriteThatFailed) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  std::string error;
  const std::unique_ptr<LcmLogWriter> writer = LcmLogWriter::open("/dev/full", error);
  ASSERT_NE(writer, nullptr) << error;
  EXPECT_EQ(writer->write("ONE", Time(), first_), Status::kOk) << "it waits in the buffer";
  EXPECT_EQ(writer->last_error(), 0);
  EXPECT_EQ(writer->flush(), Status::kRejected);
  EXPECT_EQ(writer->last_error(), ENOSPC);
  errno = EINTR;
  EXPECT_EQ(writer->write("TWO", Time(), second_), Status::kRejected);
  EXPECT_EQ(writer->flush(), Status::kRejected);
  EXPECT_EQ(writer->last_error(), ENOSPC);
}

TEST_F(LcmLog, SaysWhyAFileCannotBeOpened) {
  std::string error;
  EXPECT_EQ(LcmLogReader::open((folder_ / "missing").string(), error), nullptr);
  EXPECT_NE(error.find("missing"), std::string::npos);
  EXPECT_EQ(LcmLogReader::open(folder_.string(), error), nullptr);
  EXPECT_EQ(LcmLogWriter::open((folder_ / "no" / "folder").string(), error), nullptr);
}

}  // namespace
}  // namespace plumb
