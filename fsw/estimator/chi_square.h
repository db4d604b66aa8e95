#pragma once
// Chi-square quantiles for gating, computed once at start-up for every number of rows a gate can have.

#include <array>
#include <cstddef>

namespace plumb {

inline constexpr std::size_t kMaxGateRows = 64;

/// Probability that a chi-square variable with `dof` >= 1 degrees of freedom is below x (closed form for integer dof).
double chi_square_cdf(double x, std::size_t dof);

/// By what factor the noise variance of those measurements must be raised that pass a gate at `limit` (a squared
/// Mahalanobis distance of `dof` rows), so that they pay for the good ones that it refuses. With a small gain K the
/// covariance loses a = P(dof) of what it would without a gate, the error only b = P(dof + 2), because those that
/// contradict most are refused. For mean squared error V, covariance P and true noise R, per measurement
///   dV = b K^2 R - 2 b K V,  dP = -a K P,
/// which stay equal when the filter takes R for b / (2 b - a) times as much. Infinite where the gate is so narrow that
/// no factor helps.
double gate_cost(double limit, std::size_t dof);

class ChiSquareTable {
 public:
  /// Quantiles at `probability` (0 to 1, exclusive) for 1 to kMaxGateRows degrees of freedom.
  explicit ChiSquareTable(double probability);
  double probability() const { return probability_; }
  /// Precondition: 1 <= dof <= kMaxGateRows.
  double quantile(std::size_t dof) const;
  /// gate_cost() of that gate. Same precondition.
  double cost(std::size_t dof) const;

 private:
  double probability_;
  std::array<double, kMaxGateRows> quantiles_{};
  std::array<double, kMaxGateRows> costs_{};
};

}  // namespace plumb
