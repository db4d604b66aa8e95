#pragma once
// Property tests: a law checked over many random inputs that can be had again.
//
//   for_all(1000, [](test::Generator& g) { const double x = g.uniform(-1.0, 1.0); EXPECT_...; });
//
// Every failure prints the seed of its own case. With that seed in the environment variable PLUMB_SEED the case is the
// first one run; the other cases then differ too, so PLUMB_SEED also explores new ground.

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <string>

namespace plumb::test {

/// SplitMix64 (Steele, Lea, Flood 2014). The distributions are written out because those of the standard library differ
/// from one library to the next, and a seed must mean the same inputs everywhere.
class Generator {
 public:
  explicit Generator(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {
    state_ += 0x9E3779B97F4A7C15U;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31U);
  }
  /// Uniform in [low, high).
  double uniform(double low, double high) {
    constexpr double kUnit = 0x1.0p-53;
    return low + (high - low) * (static_cast<double>(bits() >> 11U) * kUnit);
  }
  /// Uniform over the integers low to high, both included; high - low must be far below 2^64.
  std::int64_t integer(std::int64_t low, std::int64_t high) {
    const std::uint64_t span = static_cast<std::uint64_t>(high) - static_cast<std::uint64_t>(low) + 1U;
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(low) + bits() % span);
  }
  /// Normal with mean 0 (Box-Muller).
  double normal(double sigma) {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(0.0, 1.0)));
    return sigma * radius * std::cos(uniform(0.0, 2.0 * std::numbers::pi));
  }
  /// Independent normal components.
  template <int N>
  Eigen::Matrix<double, N, 1> normal_vector(double sigma) {
    Eigen::Matrix<double, N, 1> v;
    for (int i = 0; i < N; ++i) v(i) = normal(sigma);
    return v;
  }
  /// Uniform over the unit sphere.
  Eigen::Vector3d direction() {
    for (;;) {
      const Eigen::Vector3d v = normal_vector<3>(1.0);
      if (v.norm() > 1e-3) return v.normalized();
    }
  }

 private:
  std::uint64_t state_;
};

/// $PLUMB_SEED (decimal or 0x hexadecimal), or the fixed seed of the ordinary test run.
inline std::uint64_t base_seed() {
  constexpr std::uint64_t kOrdinaryRun = 20240913;
  const char* given = std::getenv("PLUMB_SEED");
  return given != nullptr && *given != '\0' ? std::strtoull(given, nullptr, 0) : kOrdinaryRun;
}

/// Runs the body `cases` times, each on a generator of its own, and stops at the first case that fails.
template <typename Body>
void for_all(int cases, Body body) {
  const std::uint64_t base = base_seed();
  for (int i = 0; i < cases; ++i) {
    const std::uint64_t seed = base + static_cast<std::uint64_t>(i) * 0xD1342543DE82EF95U;
    const ::testing::ScopedTrace trace(__FILE__, __LINE__,
                                       "case " + std::to_string(i) + ": PLUMB_SEED=" + std::to_string(seed));
    Generator generator(seed);
    body(generator);
    if (::testing::Test::HasFailure() || ::testing::Test::IsSkipped()) return;
  }
}

}  // namespace plumb::test
