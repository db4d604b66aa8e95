#pragma once
// The rows of one joint update, whitened (every row divided by its sigma, so that R = I), and the update itself:
//
//     S = H P H^T + I = L L^T,   W = L^-1 H P,   dx = W^T L^-1 r,   P <- P - W^T W
//
// Every eigenvalue of S is at least 1, so the factorisation cannot fail on a sound covariance, and P - W^T W is
// symmetric bit for bit. Rows know which of their columns are non-zero and cost accordingly.

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "fsw/estimator/filter_state.h"
#include "fsw/math/kernels.h"

namespace plumb {

template <class Config>
class UpdateStack {
 public:
  using Layout = ErrorLayout<Config>;
  /// SLAM rows, the compressed MSCKF rows, and a range, a zero velocity or a zero rate beside them.
  static constexpr std::size_t kMaxRows = 2 * Config::kMaxSlamFeatures + Layout::kFeatures - Layout::kBeam + 8;

  void begin(const FilterState<Config>& state) {
    size_ = state.size();
    rows_ = 0;
  }
  std::size_t rows() const { return rows_; }

  /// Room for `count` more rows: their Jacobian (count x size, zeroed) to fill in. Precondition: they fit.
  MatrixView open(std::size_t count) {
    PLUMB_ASSERT(rows_ + count <= kMaxRows);
    open_ = count;
    MatrixView h = h_.view().block(rows_, 0, count, size_);
    for (std::size_t r = 0; r < count; ++r) std::fill_n(h.row(r), size_, 0.0);
    return h;
  }
  double& residual(std::size_t r) { return r_[rows_ + r]; }

  /// Adds the opened rows, and returns their normalised innovation squared, r^T (H P H^T + I)^-1 r, against the prior.
  /// Not finite if the covariance is unsound. For up to three rows at a time when the value is wanted.
  double close(const FilterState<Config>& state, const Support& support);
  /// Adds the opened rows without testing them: all of one support, or each of its own within that of the first.
  void close_untested(const FilterState<Config>& state, const Support& support);
  void close_untested(const FilterState<Config>& state, std::span<const Support> supports);
  /// Variance of the innovation of row r, in units of the row's own noise.
  double innovation_variance(std::size_t r) const { return inner(r, r) + 1.0; }
  /// Gives the noise of the last `count` rows `factor` times the variance: what a gate costs those that pass it.
  void weaken(std::size_t count, double factor);
  /// Takes the last `count` rows back.
  void discard(std::size_t count) { rows_ -= count; }

  /// Joint update of the state by all rows. The correction stands in correction() until begin(). kNumericalFault: the
  /// state is unchanged. No rows: nothing to do.
  Status apply(FilterState<Config>& state);
  const double* correction() const { return dx_; }

 private:
  static constexpr std::size_t kMaxTestedRows = 3;

  double inner(std::size_t i, std::size_t j) const;  ///< (H P H^T)(i, j)

  std::size_t size_ = 0;
  std::size_t rows_ = 0;
  std::size_t open_ = 0;
  MatrixStorage<kMaxRows, Layout::kSize> h_;
  MatrixStorage<kMaxRows, Layout::kSize> hp_;
  MatrixStorage<kMaxRows, kMaxRows> s_;
  std::array<Support, kMaxRows> support_;
  double r_[kMaxRows] = {};
  double dx_[Layout::kSize] = {};
};

template <class Config>
double UpdateStack<Config>::inner(std::size_t i, std::size_t j) const {
  const double* hp = hp_.view().row(i);
  const double* h = h_.view().row(j);
  double sum = 0.0;
  for (const Segment& s : support_[j]) sum += dot(hp + s.start, h + s.start, s.length);
  return sum;
}

template <class Config>
void UpdateStack<Config>::close_untested(const FilterState<Config>& state, const Support& support) {
  multiply_rows(h_.view().block(rows_, 0, open_, size_), support, state.covariance(),
                hp_.view().block(rows_, 0, open_, size_));
  std::fill_n(support_.begin() + rows_, open_, support);
  rows_ += open_;
}

template <class Config>
void UpdateStack<Config>::close_untested(const FilterState<Config>& state, std::span<const Support> supports) {
  PLUMB_ASSERT(supports.size() == open_);
  const std::size_t first = rows_;
  close_untested(state, supports.front());
  std::copy(supports.begin(), supports.end(), support_.begin() + first);
}

template <class Config>
double UpdateStack<Config>::close(const FilterState<Config>& state, const Support& support) {
  PLUMB_ASSERT(open_ <= kMaxTestedRows);
  const std::size_t first = rows_;
  close_untested(state, support);
  double s[kMaxTestedRows * kMaxTestedRows] = {};
  double y[kMaxTestedRows] = {};
  MatrixView l(s, open_, open_, kMaxTestedRows);
  for (std::size_t i = 0; i < open_; ++i) {
    for (std::size_t j = 0; j <= i; ++j) l(i, j) = inner(first + i, first + j) + (i == j ? 1.0 : 0.0);
    y[i] = r_[first + i];
  }
  if (!ok(cholesky_in_place(l))) return std::numeric_limits<double>::quiet_NaN();
  solve_lower_in_place(l, MatrixView(y, open_, 1, 1));
  double nis = 0.0;
  for (std::size_t i = 0; i < open_; ++i) nis += y[i] * y[i];
  return nis;
}

template <class Config>
void UpdateStack<Config>::weaken(std::size_t count, double factor) {
  const double scale = 1.0 / std::sqrt(factor);
  const std::size_t first = rows_ - count;
  scale_in_place(h_.view().block(first, 0, count, size_), scale);
  scale_in_place(hp_.view().block(first, 0, count, size_), scale);
  scale_in_place(MatrixView(r_ + first, count, 1, 1), scale);
}

template <class Config>
Status UpdateStack<Config>::apply(FilterState<Config>& state) {
  std::fill_n(dx_, Layout::kSize, 0.0);
  if (rows_ == 0) return Status::kOk;
  MatrixView s = s_.view(rows_, rows_);
  for (std::size_t j = 0; j < rows_; ++j) {
    const std::size_t below = rows_ - j;
    sum_products(hp_.view().block(j, 0, below, size_), h_.view().row(j), support_[j],
                 MatrixView(&s(j, j), below, 1, s.stride()));
    s(j, j) += 1.0;
  }
  if (!ok(cholesky_in_place(s))) return Status::kNumericalFault;
  MatrixView w = hp_.view().block(0, 0, rows_, size_);
  solve_lower_in_place(s, w);
  solve_lower_in_place(s, MatrixView(r_, rows_, 1, 1));
  for (std::size_t k = 0; k < rows_; ++k) {
    const double y = r_[k];
    const double* __restrict wk = w.row(k);
    for (std::size_t c = 0; c < size_; ++c) dx_[c] += y * wk[c];
  }
  subtract_gram(state.covariance(), w);
  state.retract(dx_);
  return Status::kOk;
}

}  // namespace plumb
