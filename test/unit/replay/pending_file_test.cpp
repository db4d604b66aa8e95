#include "tools/replay/pending_file.h"

#include <gtest/gtest.h>

#include "test/support/temporary_folder.h"
#include "tools/replay/input_error.h"

namespace plumb::replay {
namespace {

TEST(PendingFile, HasItsNameOnlyAfterCommit) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "new" / "a.txt";
  PendingFile pending(file);
  std::fputs("whole", pending.stream());
  EXPECT_FALSE(std::filesystem::exists(file));
  pending.close();
  EXPECT_FALSE(std::filesystem::exists(file));
  pending.commit();
  EXPECT_EQ(test::content_of(file), "whole");
  EXPECT_FALSE(std::filesystem::exists(pending.temporary_name()));
}

TEST(PendingFile, LeavesNothingWithoutCommitAndTheOldFileAsItWas) {
  const test::TemporaryFolder folder;
  const auto file = folder.write("a.txt", "old");
  {
    PendingFile pending(file);
    std::fputs("half", pending.stream());
  }
  EXPECT_EQ(test::content_of(file), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(PendingFile, RefusesPlacesThatCannotBeWritten) {
  const test::TemporaryFolder folder;
  const auto file = folder.write("a.txt", "");
  EXPECT_THROW(PendingFile(file / "below_a_file.txt"), InputError);
  EXPECT_THROW(PendingFile(folder.path()), InputError);
}

TEST(PendingFile, TellsAFullDisk) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "a.txt";
  std::filesystem::create_symlink("/dev/full", folder.path() / "a.txt.partial");
  PendingFile pending(file);
  std::fputs("lost", pending.stream());
  EXPECT_NO_THROW(pending.check());  // it is still in the buffer
  std::fflush(pending.stream());
  EXPECT_THROW(pending.check(), WriteError);
  EXPECT_THROW(pending.close(), WriteError);
}

}  // namespace
}  // namespace plumb::replay
