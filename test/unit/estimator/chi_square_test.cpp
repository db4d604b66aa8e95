#include "fsw/estimator/chi_square.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "test/support/property.h"

namespace plumb {
namespace {

struct Tabulated {
  std::size_t dof;
  double at_50, at_90, at_95, at_99;
};
// scipy.stats.chi2.ppf, SciPy 1.14
constexpr Tabulated kTable[] = {
    {1, 0.454936423119572, 2.705543454095404, 3.841458820694124, 6.6348966010212145},
    {2, 1.386294361119891, 4.605170185988092, 5.991464547107979, 9.21034037197618},
    {3, 2.3659738843753377, 6.251388631170325, 7.814727903251179, 11.344866730144373},
    {4, 3.3566939800333224, 7.779440339734858, 9.487729036781154, 13.276704135987622},
    {5, 4.351460191095526, 9.236356899781123, 11.070497693516351, 15.08627246938899},
    {7, 6.345811195521515, 12.017036623780532, 14.067140449340169, 18.475306906582357},
    {10, 9.34181776559197, 15.987179172105265, 18.307038053275146, 23.209251158954356},
    {21, 20.337227563547934, 29.61508943618274, 32.670573340917315, 38.93217268351607},
    {33, 32.33578087994843, 43.74517955943419, 47.39988391908093, 54.77553976011035},
    {45, 44.33511775767295, 57.50530474499599, 61.65623337627955, 69.95683206583814},
    {60, 59.33466627644246, 74.3970057193686, 79.08194448784874, 88.37941890144937},
    {61, 60.33464416511231, 75.51408945989918, 80.23209784876272, 89.59134449068712},
    {62, 61.334622775315836, 76.63020800448774, 81.3810151888991, 90.80153203083871},
    {63, 62.33460207230615, 77.74538483569489, 82.5287265414718, 92.01002361413214},
};

TEST(ChiSquare, QuantilesAreTheTabulatedOnes) {
  const ChiSquareTable at_50(0.50);
  const ChiSquareTable at_90(0.90);
  const ChiSquareTable at_95(0.95);
  const ChiSquareTable at_99(0.99);
  for (const Tabulated& row : kTable) {
    EXPECT_NEAR(at_50.quantile(row.dof), row.at_50, 1e-9 * row.at_50) << row.dof;
    EXPECT_NEAR(at_90.quantile(row.dof), row.at_90, 1e-9 * row.at_90) << row.dof;
    EXPECT_NEAR(at_95.quantile(row.dof), row.at_95, 1e-9 * row.at_95) << row.dof;
    EXPECT_NEAR(at_99.quantile(row.dof), row.at_99, 1e-9 * row.at_99) << row.dof;
  }
}

TEST(ChiSquare, TheQuantileUndoesTheDistribution) {
  for (const double probability : {0.01, 0.3, 0.683, 0.95, 0.9999}) {
    const ChiSquareTable table(probability);
    for (std::size_t dof = 1; dof <= kMaxGateRows; ++dof) {
      EXPECT_NEAR(chi_square_cdf(table.quantile(dof), dof), probability, 1e-11) << dof;
    }
  }
}

TEST(ChiSquare, MoreRowsAllowMore) {
  const ChiSquareTable table(0.95);
  for (std::size_t dof = 2; dof <= kMaxGateRows; ++dof) EXPECT_GT(table.quantile(dof), table.quantile(dof - 1));
}

// The derivative of the distribution is the density x^(k/2-1) e^(-x/2) / (2^(k/2) Gamma(k/2)).
TEST(ChiSquare, TheDistributionHasTheRightDensity) {
  for (std::size_t dof = 1; dof <= kMaxGateRows; ++dof) {
    const double k = 0.5 * static_cast<double>(dof);
    for (const double x : {0.5, 2.0, 10.0, 40.0, 90.0}) {
      const double density = std::exp((k - 1.0) * std::log(x) - 0.5 * x - k * std::log(2.0) - std::lgamma(k));
      const double h = 1e-4;
      const double slope = (chi_square_cdf(x + h, dof) - chi_square_cdf(x - h, dof)) / (2.0 * h);
      EXPECT_NEAR(slope, density, 1e-6) << dof << " at " << x;
    }
  }
}

TEST(ChiSquare, NothingLiesBelowZeroAndNotANumberIsNotSmall) {
  EXPECT_EQ(chi_square_cdf(0.0, 2), 0.0);
  EXPECT_EQ(chi_square_cdf(-1.0, 2), 0.0);
  EXPECT_EQ(chi_square_cdf(1e4, 2), 1.0);
  // A gate written as nis <= quantile lets no NaN through.
  EXPECT_FALSE(std::numeric_limits<double>::quiet_NaN() <= ChiSquareTable(0.95).quantile(2));
}

/// Mean squared error over mean variance of a constant that is measured often through a gate of two sigma, by a filter
/// that takes the noise variance for `raised` times what it is.
double honesty(double raised) {
  constexpr int kRuns = 4000;
  constexpr int kMeasurements = 60;
  constexpr double kGate = 4.0;
  double squares = 0.0;
  double variances = 0.0;
  test::Generator g(test::base_seed());
  for (int run = 0; run < kRuns; ++run) {
    double variance = 0.05;
    double error = g.normal(std::sqrt(variance));
    for (int k = 0; k < kMeasurements; ++k) {
      const double innovation = error + g.normal(1.0);
      if (innovation * innovation > kGate * (variance + 1.0)) continue;
      const double gain = variance / (variance + raised);
      error -= gain * innovation;
      variance *= 1.0 - gain;
    }
    squares += error * error;
    variances += variance;
  }
  return squares / variances;
}

// A good measurement that is refused lowers the error no more than the covariance, but it is those that contradict most
// that are refused: the others are worth less than they look.
TEST(GateCost, PaysForTheGoodMeasurementsThatAreRefused) {
  constexpr double kSampling = 0.07;  // three standard deviations of a ratio from 4000 runs
  EXPECT_GT(honesty(1.0), 1.1 + kSampling);
  EXPECT_NEAR(honesty(gate_cost(4.0, 1)), 1.0, kSampling);
}

TEST(GateCost, AWideGateCostsNothing) {
  for (std::size_t dof = 1; dof <= 24; ++dof) {
    EXPECT_GT(gate_cost(ChiSquareTable(0.95).quantile(dof), dof), 1.03) << dof;
    EXPECT_NEAR(gate_cost(1e3, dof), 1.0, 1e-12) << dof;
    EXPECT_LT(ChiSquareTable(0.9).cost(dof), 3.0) << dof;  // the narrowest gate that vision.gate_probability allows
  }
}

TEST(ChiSquareDeathTest, ThereIsNoGateWithoutRows) {
  const ChiSquareTable table(0.95);
  EXPECT_DEATH(static_cast<void>(table.quantile(0)), "");
  EXPECT_DEATH(static_cast<void>(table.quantile(kMaxGateRows + 1)), "");
}

}  // namespace
}  // namespace plumb
