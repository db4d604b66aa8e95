#include "fsw/math/kernels.h"

#include <cmath>

namespace plumb {
namespace {

/// y[0..n) += s * x[0..n): the one inner loop of nearly everything here.
inline void axpy(double s, const double* __restrict x, double* __restrict y, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) y[i] += s * x[i];
}

inline double dot(const double* a, const double* b, std::size_t n) {
  // Four running sums in a fixed order: vectorises without leave to reorder.
  double s0 = 0.0, s1 = 0.0, s2 = 0.0, s3 = 0.0;
  std::size_t i = 0;
  for (; i + 4 <= n; i += 4) {
    s0 += a[i] * b[i];
    s1 += a[i + 1] * b[i + 1];
    s2 += a[i + 2] * b[i + 2];
    s3 += a[i + 3] * b[i + 3];
  }
  for (; i < n; ++i) s0 += a[i] * b[i];
  return (s0 + s1) + (s2 + s3);
}

// Register tile of the rank update: 4 rows by 8 columns of doubles.
constexpr std::size_t kTileRows = 4;
constexpr std::size_t kTileCols = 8;

/// p[i0.., j0..] -= sum_k w[k, i0..]^T w[k, j0..] over one full tile.
inline void subtract_tile(MatrixView p, ConstMatrixView w, std::size_t i0, std::size_t j0) {
  double acc[kTileRows][kTileCols] = {};
  for (std::size_t k = 0; k < w.rows(); ++k) {
    const double* __restrict wi = w.row(k) + i0;
    const double* __restrict wj = w.row(k) + j0;
    for (std::size_t r = 0; r < kTileRows; ++r) {
      for (std::size_t c = 0; c < kTileCols; ++c) acc[r][c] += wi[r] * wj[c];
    }
  }
  for (std::size_t r = 0; r < kTileRows; ++r) {
    for (std::size_t c = 0; c < kTileCols; ++c) p(i0 + r, j0 + c) -= acc[r][c];
  }
}

inline void subtract_edge(MatrixView p, ConstMatrixView w, std::size_t i0, std::size_t i1, std::size_t j0,
                          std::size_t j1) {
  for (std::size_t i = i0; i < i1; ++i) {
    for (std::size_t j = j0; j < j1; ++j) {
      double acc = 0.0;
      for (std::size_t k = 0; k < w.rows(); ++k) acc += w(k, i) * w(k, j);
      p(i, j) -= acc;
    }
  }
}

}  // namespace

Status cholesky_in_place(MatrixView a) {
  const std::size_t n = a.rows();
  PLUMB_ASSERT(a.cols() >= n);
  for (std::size_t j = 0; j < n; ++j) {
    double* aj = a.row(j);
    for (std::size_t k = 0; k < j; ++k) aj[k] = (aj[k] - dot(aj, a.row(k), k)) / a(k, k);
    const double pivot = aj[j] - dot(aj, aj, j);
    if (!(pivot > 0.0) || !std::isfinite(pivot)) return Status::kNumericalFault;
    aj[j] = std::sqrt(pivot);
  }
  return Status::kOk;
}

void solve_lower_in_place(ConstMatrixView l, MatrixView b) {
  const std::size_t n = l.rows();
  PLUMB_ASSERT(b.rows() == n);
  for (std::size_t i = 0; i < n; ++i) {
    double* bi = b.row(i);
    for (std::size_t k = 0; k < i; ++k) axpy(-l(i, k), b.row(k), bi, b.cols());
    const double inverse = 1.0 / l(i, i);
    for (std::size_t c = 0; c < b.cols(); ++c) bi[c] *= inverse;
  }
}

void solve_lower_transposed_in_place(ConstMatrixView l, double* x) {
  for (std::size_t i = l.rows(); i-- > 0;) {
    x[i] /= l(i, i);
    axpy(-x[i], l.row(i), x, i);
  }
}

void subtract_gram(MatrixView p, ConstMatrixView w) {
  const std::size_t n = p.rows();
  PLUMB_ASSERT(p.cols() == n && w.cols() == n);
  std::size_t i0 = 0;
  for (; i0 + kTileRows <= n; i0 += kTileRows) {
    std::size_t j0 = 0;
    for (; j0 + kTileCols <= i0 + kTileRows; j0 += kTileCols) subtract_tile(p, w, i0, j0);
    subtract_edge(p, w, i0, i0 + kTileRows, j0, i0 + kTileRows);
  }
  subtract_edge(p, w, i0, n, 0, n);
  mirror_lower(p);
}

void scale_in_place(MatrixView a, double factor) {
  for (std::size_t r = 0; r < a.rows(); ++r) {
    for (std::size_t c = 0; c < a.cols(); ++c) a(r, c) *= factor;
  }
}

void mirror_lower(MatrixView p) {
  for (std::size_t i = 0; i < p.rows(); ++i) {
    for (std::size_t j = 0; j < i; ++j) p(j, i) = p(i, j);
  }
}

void triangularise(MatrixView a, std::size_t columns) {
  PLUMB_ASSERT(columns <= a.cols());
  const std::size_t steps = columns < a.rows() ? columns : a.rows();
  for (std::size_t k = 0; k < steps; ++k) {
    const std::size_t width = a.cols() - k;
    fold_rows(a.block(k, k, 1, width), a.block(k + 1, k, a.rows() - k - 1, width), 1);
  }
}

void fold_rows(MatrixView r, MatrixView b, std::size_t columns) {
  const std::size_t n = r.cols();
  PLUMB_ASSERT(b.cols() == n && columns <= r.rows() && columns <= n && n <= kMaxFoldColumns);
  double projection[kMaxFoldColumns];
  for (std::size_t k = 0; k < columns; ++k) {
    // Reflection of the column (r(k,k), b(:,k)) onto its first axis, along v = (v0, b(:,k)).
    double tail = 0.0;
    for (std::size_t i = 0; i < b.rows(); ++i) tail += b(i, k) * b(i, k);
    if (tail == 0.0) continue;
    double* rk = r.row(k);
    const double norm = std::sqrt(rk[k] * rk[k] + tail);
    const double alpha = rk[k] > 0.0 ? -norm : norm;
    const double v0 = rk[k] - alpha;
    const double scale = 2.0 / (v0 * v0 + tail);
    rk[k] = alpha;
    const std::size_t rest = n - k - 1;
    for (std::size_t c = 0; c < rest; ++c) projection[c] = v0 * rk[k + 1 + c];
    for (std::size_t i = 0; i < b.rows(); ++i) axpy(b(i, k), b.row(i) + k + 1, projection, rest);
    axpy(-scale * v0, projection, rk + k + 1, rest);
    for (std::size_t i = 0; i < b.rows(); ++i) {
      axpy(-scale * b(i, k), projection, b.row(i) + k + 1, rest);
      b(i, k) = 0.0;
    }
  }
}

}  // namespace plumb
