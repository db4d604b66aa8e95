#include "tools/replay/pending_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "config/input_error.h"
#include "test/support/temporary_folder.h"

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

TEST(PendingFile, NeverTakesThePlaceOfADeviceOrPipe) {
  const test::TemporaryFolder folder;
  const auto pipe = folder.path() / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THROW(PendingFile{pipe}, InputError);
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
}

// Two that write the same file would leave a mixture of both. The second one is told, the first one is not disturbed.
TEST(PendingFile, RefusesWhatIsBeingWrittenAlready) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "a.txt";
  {
    PendingFile first(file);
    std::fputs("first", first.stream());
    std::fflush(first.stream());
    EXPECT_THROW(PendingFile second(file), InputError);
    first.close();
    EXPECT_THROW(PendingFile third(file), InputError);
    first.commit();
  }
  EXPECT_EQ(test::content_of(file), "first");
  PendingFile next(file);
  std::fputs("next", next.stream());
  next.close();
  next.commit();
  EXPECT_EQ(test::content_of(file), "next");
}

TEST(PendingFile, TakesOverWhatAKilledRunLeft) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "a.txt";
  folder.write("a.txt.partial", "much of what nobody wants any more");
  PendingFile pending(file);
  std::fputs("whole", pending.stream());
  pending.close();
  pending.commit();
  EXPECT_EQ(test::content_of(file), "whole");
}

TEST(PendingFile, TellsANameThatWasTakenMeanwhile) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "a.txt";
  PendingFile pending(file);
  pending.close();
  folder.write("a.txt/in_a_folder", "");
  EXPECT_THROW(pending.commit(), WriteError);
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
