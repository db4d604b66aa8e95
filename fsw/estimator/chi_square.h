#pragma once
// Chi-square quantiles for gating, computed once at start-up for every number of rows a gate can have.

#include <array>
#include <cstddef>

namespace plumb {

inline constexpr std::size_t kMaxGateRows = 64;

/// Probability that a chi-square variable with `dof` >= 1 degrees of freedom is below x (closed form for integer dof).
double chi_square_cdf(double x, std::size_t dof);

/// By what factor the noise variance of those measurements must be raised that pass a gate at `limit` (a squared
/// Mahalanobis distance of `dof` rows), so that they pay for the good ones that it refuses. Of a small gain K the
/// covariance takes a = P(dof) on average, the correction b = P(dof + 2): refused are those that contradict most. Mean
/// squared error and covariance then go as dV = (b K^2 R - 2 b K V) and dP = -a K P, equal when R is taken b / (2 b -
/// a) times too large. Infinite for a gate so narrow that no factor helps.
double gate_cost(double limit, std::size_t dof);

class ChiSquareTable {
 public:
  /// Quantiles at `probability` (0 to 1, exclusive) for 1 to kMaxGateRows degrees of freedom.
  explicit ChiSquareTable(double probability);
  /// Precondition: 1 <= dof <= kMaxGateRows.
  double quantile(std::size_t dof) const;

 private:
  std::array<double, kMaxGateRows> quantiles_{};
};

}  // namespace plumb
