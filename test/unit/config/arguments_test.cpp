#include "config/arguments.h"

#include <gtest/gtest.h>

namespace plumb {
namespace {

enum class Fruit { kApple = 3, kPear = 7 };

/// What a program says to its arguments; empty: nothing.
std::string answer_to(const std::string& arguments, double& number, Fruit& fruit) {
  CLI::App app("program");
  app.add_option("--number", number)->check(number_from(-0.5, 1e6));
  app.add_option("--fruit", fruit)->transform(one_of<Fruit>({{"apple", Fruit::kApple}, {"pear", Fruit::kPear}}));
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
  return "";
}

TEST(Arguments, ANumberIsOneAndInItsRange) {
  double number = 0.0;
  Fruit fruit{};
  for (const char* bad : {"nan", "-nan", "inf", "-inf", "1e999", "-0.6", "1000001", "1x", "x"}) {
    EXPECT_EQ(answer_to(std::string("--number=") + bad, number, fruit),
              "--number: '" + std::string(bad) + "' refused; expected a number from -0.5 to 1000000");
    EXPECT_EQ(number, 0.0);
  }
  EXPECT_EQ(answer_to("--number=1e6", number, fruit), "");
  EXPECT_EQ(number, 1e6);
  EXPECT_EQ(answer_to("--number=-0.5", number, fruit), "");
  EXPECT_EQ(number, -0.5);
}

TEST(Arguments, AChoiceNamesWhatThereIs) {
  double number = 0.0;
  Fruit fruit{};
  for (const char* bad : {"plum", "3", "apple pear"}) {
    EXPECT_EQ(answer_to("--fruit=\"" + std::string(bad) + "\"", number, fruit),
              "--fruit: '" + std::string(bad) + "' refused; expected one of apple, pear");
  }
  EXPECT_EQ(answer_to("--fruit=Pear", number, fruit), "");
  EXPECT_EQ(fruit, Fruit::kPear);
}

}  // namespace
}  // namespace plumb
