#include "fsw/estimator/chi_square.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "fsw/base/assert.h"
#include "fsw/math/exact.h"

namespace plumb {
namespace {
constexpr int kBisections = 80;  // halves an interval of a few hundred below one double ulp
constexpr double kPi = std::numbers::pi;
}  // namespace

double chi_square_cdf(double x, std::size_t dof) {
  if (!(x > 0.0)) return 0.0;
  // Upper tail by the recurrence Q(k + 2) = Q(k) + (x/2)^(k/2) e^(-x/2) / Gamma(k/2 + 1).
  const double half = 0.5 * x;
  double tail = 0.0;
  double term = 0.0;
  std::size_t k = 0;
  if (dof % 2 == 0) {
    term = exact::exp(-half);
    tail = term;
    k = 2;
  } else {
    tail = exact::erfc(std::sqrt(half));
    term = std::sqrt(2.0 * x / kPi) * exact::exp(-half);
    k = 1;
  }
  if (dof % 2 == 0) {
    for (; k < dof; k += 2) {
      term *= half / (0.5 * static_cast<double>(k));
      tail += term;
    }
  } else {
    for (; k < dof; k += 2) {
      tail += term;
      term *= x / static_cast<double>(k + 2);
    }
  }
  return 1.0 - tail;
}

double gate_cost(double limit, std::size_t dof) {
  const double a = chi_square_cdf(limit, dof);
  const double b = chi_square_cdf(limit, dof + 2);
  return 2.0 * b > a ? b / (2.0 * b - a) : std::numeric_limits<double>::infinity();
}

ChiSquareTable::ChiSquareTable(double probability) : probability_(probability) {
  for (std::size_t i = 0; i < kMaxGateRows; ++i) {
    double low = 0.0;
    double high = 40.0 + 8.0 * static_cast<double>(i + 1);
    for (int b = 0; b < kBisections; ++b) {
      const double middle = 0.5 * (low + high);
      (chi_square_cdf(middle, i + 1) < probability ? low : high) = middle;
    }
    quantiles_[i] = 0.5 * (low + high);
    costs_[i] = gate_cost(quantiles_[i], i + 1);
  }
}

double ChiSquareTable::quantile(std::size_t dof) const {
  PLUMB_ASSERT(dof >= 1 && dof <= kMaxGateRows);
  return quantiles_[dof - 1];
}

double ChiSquareTable::cost(std::size_t dof) const {
  PLUMB_ASSERT(dof >= 1 && dof <= kMaxGateRows);
  return costs_[dof - 1];
}

}  // namespace plumb
