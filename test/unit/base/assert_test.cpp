#include "fsw/base/assert.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace plumb {
namespace {

void print_site(const AssertSite& site) { std::fprintf(stderr, "%s:%d: %s\n", site.file, site.line, site.condition); }

void break_again(const AssertSite& site) {
  print_site(site);
  PLUMB_ASSERT(site.line < 0);
}

class AssertDeathTest : public ::testing::Test {
 protected:
  void TearDown() override { set_assert_handler(nullptr); }
};

TEST_F(AssertDeathTest, ATrueConditionDoesNothing) {
  set_assert_handler(print_site);
  int evaluations = 0;
  PLUMB_ASSERT(++evaluations == 1);
  EXPECT_EQ(evaluations, 1);
}

TEST_F(AssertDeathTest, TellsTheHandlerWhereAndWhatAndStops) {
  set_assert_handler(print_site);
  EXPECT_DEATH(PLUMB_ASSERT(1 + 1 == 3), "assert_test\\.cpp:[0-9]+: 1 \\+ 1 == 3");
}

TEST_F(AssertDeathTest, StopsWithoutAHandler) { EXPECT_DEATH(PLUMB_ASSERT(false), ""); }

TEST_F(AssertDeathTest, IsKeptInEveryBuild) {
  const bool never = false;
  EXPECT_DEATH(PLUMB_ASSERT(never), "");
}

TEST_F(AssertDeathTest, AHandlerThatBreaksAnAssertionStopsToo) {
  set_assert_handler(break_again);
  // Told once, of the first.
  EXPECT_DEATH(PLUMB_ASSERT(false), "^[^\n]*: false\n$");
}

}  // namespace
}  // namespace plumb
