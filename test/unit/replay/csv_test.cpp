#include "tools/replay/csv.h"

#include <gtest/gtest.h>

#include <cmath>

#include "config/input_error.h"
#include "test/support/temporary_folder.h"

namespace plumb::replay {
namespace {

TEST(Csv, ReadsRowsPastCommentsBlankLinesAndCarriageReturns) {
  const test::TemporaryFolder folder;
  CsvReader csv(folder.write("a.csv", "#t,x\r\n\r\n 1 , 2.5\r\n   \n# more\n3,-1e-3\n"));
  ASSERT_TRUE(csv.next());
  EXPECT_EQ(csv.columns(), 2U);
  EXPECT_EQ(csv.time(), Time::from_ns(1));
  EXPECT_EQ(csv.number(1), 2.5);
  ASSERT_TRUE(csv.next());
  EXPECT_EQ(csv.time(), Time::from_ns(3));
  EXPECT_EQ(csv.number(1), -1e-3);
  EXPECT_FALSE(csv.next());
}

TEST(Csv, ReadsNotANumberAndLongLines) {
  const test::TemporaryFolder folder;
  CsvReader csv(
      folder.write("a.csv", "1,nan,inf,+2," + std::string(100'000, ' ') + "7" + std::string(100'000, '0') + "\n"));
  ASSERT_TRUE(csv.next());
  EXPECT_TRUE(std::isnan(csv.number(1)));
  EXPECT_TRUE(std::isinf(csv.number(2)));
  EXPECT_EQ(csv.number(3), 2.0);
  EXPECT_EQ(csv.text(4).size(), 100'001U);
}

struct BadCase {
  const char* name;
  const char* content;
  const char* message;  // must be part of what the user is told
  bool whole = true;    // the last row has a line end
};

TEST(Csv, NamesFileAndLineOfEveryFault) {
  const BadCase cases[] = {
      {"text for a time", "1,2\nabc,2", "line 2: column 1: expected a time stamp in whole nanoseconds, found 'abc'"},
      {"time with a fraction", "1.5,2", "line 1: column 1"},
      {"negative time", "-1,2", "line 1: column 1"},
      {"time beyond 64 bits", "99999999999999999999,2", "line 1: column 1"},
      {"time of never", "9223372036854775807,2", "line 1: column 1"},
      {"time stands still", "#t,x\n5,2\n5,2", "line 3: time stamp 5 is not after 5"},
      {"time runs back", "5,2\n4,2", "line 2: time stamp 4 is not after 5"},
      {"text for a number", "1,2x", "line 1: column 2: expected a number, found '2x'"},
      {"empty number", "1,", "line 1: column 2: expected a number, found ''"},
      {"column missing", "1", "line 1: expected 2 columns (time, value), found 1"},
      {"cut within the last number", "1,2\n2,3", "line 2: no line end: the file looks cut short", false},
      {"column too many", "1,2,3", "line 1: expected 2 columns (time, value), found 3"},
  };
  for (const BadCase& c : cases) {
    SCOPED_TRACE(c.name);
    const test::TemporaryFolder folder;
    CsvReader csv(folder.write("bad.csv", std::string(c.content) + (c.whole ? "\n" : "")));
    try {
      while (csv.next()) {
        csv.expect_columns(2, 2, "time, value");
        static_cast<void>(csv.time());
        static_cast<void>(csv.number(1));
      }
      ADD_FAILURE() << "was not refused";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("bad.csv"), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(c.message), std::string::npos) << error.what();
    }
  }
}

TEST(Csv, RefusesMissingFilesAndFolders) {
  const test::TemporaryFolder folder;
  EXPECT_THROW(CsvReader(folder.path() / "missing.csv"), InputError);
  EXPECT_THROW(CsvReader(folder.path()), InputError);
}

}  // namespace
}  // namespace plumb::replay
