// plumb-fsw as its user meets it before it flies.

#include <gtest/gtest.h>

#include <string>

#include "process/log_file.h"
#include "process/mode_page.h"
#include "process/schedule_page.h"
#include "test/support/process.h"
#include "test/support/temporary_folder.h"

namespace plumb::test {
namespace {

constexpr const char* kExample = PLUMB_SOURCE_DIR "/config/example.yaml";
constexpr int kBadInput = 2 << 8;  // as waitpid tells an exit code
constexpr int kNotThere = 4 << 8;

ProgramOutput fsw(const std::string& arguments) {
  return output_of(std::string(PLUMB_FSW) + " " + arguments + " 2>&1");
}

TEST(Process, TheExampleCanBeFlown) {
  const ProgramOutput run = fsw(std::string("--dry-run ") + kExample);
  EXPECT_EQ(run.exit_status, 0) << run.text;
}

TEST(Process, NamesEveryFaultOfAConfigurationAndFliesNothing) {
  const TemporaryFolder folder;
  std::string text = content_of(kExample);
  for (const char* key : {"intrinsics", "accel_range_g", "max_range_m", "vision.pixel_noise"}) {
    text.replace(text.find(key), 3, "xyz");
  }
  const ProgramOutput run = fsw(folder.write("bad.yaml", text).string());
  EXPECT_EQ(run.exit_status, kBadInput);
  for (const char* what : {"'camera.intrinsics' is missing", "'imu.xyzel_range_g' is not known",
                           "'range.max_range_m' is missing", "xyzion.pixel_noise"}) {
    EXPECT_NE(run.text.find(what), std::string::npos) << what << " in\n" << run.text;
  }
}

TEST(Process, NamesWhatThisComputerCannotGive) {
  const TemporaryFolder folder;
  std::string text = content_of(kExample);
  const auto change = [&text](const std::string& piece, const std::string& by) {
    text.replace(text.find(piece), piece.size(), by);
  };
  change("core: 2", "core: 999");
  change("core: 3", "core: 0");
  const std::string odd = folder.write("odd.yaml", text).string();
  const ProgramOutput warned = fsw("--dry-run " + odd);
  EXPECT_EQ(warned.exit_status, 0) << "it would fly on any core: " << warned.text;
  EXPECT_NE(warned.text.find(odd + ": key 'threads.tick.core': 999 is no core"), std::string::npos) << warned.text;
  EXPECT_EQ(warned.text.find("threads.nav"), std::string::npos) << warned.text;
  change("udpm://239.255.76.67:7667?ttl=0", "junk");
  const std::string bad = folder.write("bad.yaml", text).string();
  const ProgramOutput refused = fsw("--dry-run " + bad);
  EXPECT_EQ(refused.exit_status, kBadInput);
  EXPECT_NE(refused.text.find(bad + ": key 'lcm': 'junk' refused; expected"), std::string::npos) << refused.text;
  const ProgramOutput nowhere = fsw("--dry-run --log /nonexistent/flight.lcm " + odd);
  EXPECT_EQ(nowhere.exit_status, kBadInput);
  EXPECT_NE(nowhere.text.find("expected a folder /nonexistent"), std::string::npos) << nowhere.text;
}

TEST(Process, NamesEveryDeviceThatIsNotThereAndLeavesNoLog) {
  const TemporaryFolder folder;
  std::string text = content_of(kExample);
  const std::string none = (folder.path() / "none").string();
  for (const char* device : {"/dev/ttyUSB0", "/dev/video0"}) text.replace(text.find(device), std::strlen(device), none);
  text.replace(text.find("can0"), 4, "none0");
  const std::string log = (folder.path() / "flight.lcm").string();
  const ProgramOutput run = fsw(folder.write("flight.yaml", text).string() + " --log " + log);
  EXPECT_EQ(run.exit_status, kNotThere) << run.text;
  for (const char* device : {"imu: ", "camera: ", "range: "}) {
    EXPECT_NE(run.text.find(device), std::string::npos) << device << " in\n" << run.text;
  }
  EXPECT_FALSE(std::filesystem::exists(log));
}

TEST(Process, ALogNeverTakesThePlaceOfAnother) {
  const TemporaryFolder folder;
  const std::string name = (folder.path() / "flight.lcm").string();
  EXPECT_EQ(free_name(name), name);
  folder.write("flight.lcm", "");
  EXPECT_EQ(free_name(name), (folder.path() / "flight-1.lcm").string());
  folder.write("flight-1.lcm", "");
  EXPECT_EQ(free_name(name), (folder.path() / "flight-2.lcm").string());
}

TEST(Process, TheDocumentHasTheScheduleThatFlies) {
  EXPECT_NE(content_of(PLUMB_SOURCE_DIR "/docs/executive.md").find(schedule_page()), std::string::npos)
      << "docs/executive.md needs what plumb-fsw --schedule prints:\n"
      << schedule_page();
}

TEST(Process, TheDocumentHasTheModesThatFly) {
  const std::string document = content_of(PLUMB_SOURCE_DIR "/docs/executive.md");
  for (const std::string& page : {mode_page(), sensor_page()}) {
    EXPECT_NE(document.find(page), std::string::npos) << "docs/executive.md needs what plumb-fsw --modes prints:\n"
                                                      << page;
  }
}

}  // namespace
}  // namespace plumb::test
