#include "fsw/math/exact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "test/support/property.h"

namespace plumb {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kCases = 20'000;

/// Units in the last place of `expected`, which the C library rounds to less than one.
double ulp(double value, double expected) {
  if (value == expected) return 0.0;
  return std::abs(value - expected) / (std::nextafter(std::abs(expected), kInfinity) - std::abs(expected));
}

using Function = double (*)(double);
void expect_near(Function own, Function library, double low, double high, double limit_ulp) {
  test::for_all(kCases, [&](test::Generator& g) {
    const double x = g.uniform(low, high);
    EXPECT_LE(ulp(own(x), library(x)), limit_ulp) << "of " << x;
  });
}

/// Over many orders of magnitude, of either sign.
double any_scale(test::Generator& g, double lowest, double highest) {
  const double size = std::pow(10.0, g.uniform(lowest, highest));
  return g.integer(0, 1) == 0 ? size : -size;
}

TEST(Exact, SineAndCosineUpToTheirZeros) {
  expect_near(exact::sin, std::sin, -3.0, 3.0, 2.0);
  expect_near(exact::cos, std::cos, -1.5, 1.5, 2.0);
  test::for_all(kCases, [](test::Generator& g) {
    const double x = any_scale(g, -300.0, 0.0);
    EXPECT_LE(ulp(exact::sin(x), std::sin(x)), 2.0) << x;
  });
}

TEST(Exact, SineAndCosineOfManyTurns) {
  test::for_all(kCases, [](test::Generator& g) {
    const double x = g.uniform(-1e5, 1e5);
    EXPECT_LE(std::abs(exact::sin(x) - std::sin(x)), 3e-16) << x;
    EXPECT_LE(std::abs(exact::cos(x) - std::cos(x)), 3e-16) << x;
  });
}

TEST(Exact, Tangent) { expect_near(exact::tan, std::tan, -1.57, 1.57, 4.0); }

TEST(Exact, Arctangent) {
  expect_near(exact::atan, std::atan, -10.0, 10.0, 2.0);
  test::for_all(kCases, [](test::Generator& g) {
    const double x = any_scale(g, -300.0, 300.0);
    EXPECT_LE(ulp(exact::atan(x), std::atan(x)), 2.0) << x;
  });
}

TEST(Exact, ArctangentOfTwo) {
  test::for_all(kCases, [](test::Generator& g) {
    const double x = any_scale(g, -9.0, 9.0);
    const double y = any_scale(g, -9.0, 9.0);
    EXPECT_LE(ulp(exact::atan2(y, x), std::atan2(y, x)), 3.0) << y << ", " << x;
  });
  EXPECT_EQ(exact::atan2(0.0, 0.0), 0.0);
  EXPECT_EQ(exact::atan2(0.0, -1.0), std::numbers::pi);
  EXPECT_EQ(exact::atan2(-0.0, -1.0), -std::numbers::pi);
  EXPECT_EQ(exact::atan2(1.0, 0.0), 0.5 * std::numbers::pi);
}

TEST(Exact, Exponential) {
  expect_near(exact::exp, std::exp, -1.0, 1.0, 2.0);
  expect_near(exact::exp, std::exp, -708.0, 709.0, 2.0);
  EXPECT_EQ(exact::exp(0.0), 1.0);
  EXPECT_EQ(exact::exp(-708.5), 0.0);
  EXPECT_EQ(exact::exp(709.5), kInfinity);
}

TEST(Exact, Logarithm) {
  expect_near(exact::log, std::log, 0.5, 2.0, 2.0);
  test::for_all(kCases, [](test::Generator& g) {
    const double x = std::abs(any_scale(g, -300.0, 300.0));
    EXPECT_LE(ulp(exact::log(x), std::log(x)), 2.0) << x;
  });
  EXPECT_EQ(exact::log(1.0), 0.0);
  for (const double x : {0.0, -1.0, kInfinity}) EXPECT_TRUE(std::isnan(exact::log(x))) << x;
}

TEST(Exact, ComplementOfTheErrorFunction) {
  test::for_all(kCases, [](test::Generator& g) {
    const double x = g.uniform(0.0, 26.0);
    EXPECT_NEAR(exact::erfc(x) / std::erfc(x), 1.0, 1e-12) << x;
  });
  EXPECT_EQ(exact::erfc(0.0), 1.0);
  EXPECT_EQ(exact::erfc(26.0), 0.0);
}

TEST(Exact, Hypotenuse) {
  test::for_all(kCases, [](test::Generator& g) {
    const double a = any_scale(g, -9.0, 9.0);
    const double b = any_scale(g, -9.0, 9.0);
    EXPECT_LE(ulp(exact::hypot(a, b), std::hypot(a, b)), 2.0) << a << ", " << b;
  });
}

TEST(Exact, WhatIsNoNumberStaysSo) {
  for (const Function f : {exact::sin, exact::cos, exact::tan, exact::atan, exact::exp, exact::log, exact::erfc}) {
    EXPECT_TRUE(std::isnan(f(kNaN)));
  }
  EXPECT_TRUE(std::isnan(exact::atan2(kNaN, 1.0)));
  EXPECT_TRUE(std::isnan(exact::atan2(1.0, kNaN)));
  EXPECT_TRUE(std::isnan(exact::hypot(kNaN, 1.0)));
  for (const Function f : {exact::sin, exact::cos, exact::tan}) EXPECT_TRUE(std::isnan(f(kInfinity)));
}

}  // namespace
}  // namespace plumb
