#include "fsw/math/kernels.h"

#include <cmath>
#include <cstring>

namespace plumb {
namespace {

/// y[0..n) += s * x[0..n).
inline void axpy(double s, const double* __restrict x, double* __restrict y, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) y[i] += s * x[i];
}

// Tiles of a result are kept in registers while the sums over k run: every element of its own, in the order of k, so
// that neither their size nor the width of a register shows in the bits. A compiler left to itself keeps them in
// memory.
using Pair [[gnu::vector_size(2 * sizeof(double))]] = double;
constexpr std::size_t kPair = 2;
constexpr std::size_t kTileRows = 4;
#if defined(__aarch64__)
constexpr std::size_t kTileCols = 8;  // 16 of 32 registers
constexpr std::size_t kRowCols = 32;
#else
constexpr std::size_t kTileCols = 4;  // 8 of 16 registers
constexpr std::size_t kRowCols = 16;
#endif

inline Pair load(const double* from) {
  Pair pair;
  std::memcpy(&pair, from, sizeof pair);
  return pair;
}
inline void store(double* to, Pair pair) { std::memcpy(to, &pair, sizeof pair); }

template <std::size_t Rows, std::size_t Cols>
using Tile = Pair[Rows][Cols / kPair];

/// tile += sum over k of factor(r, k) * row k of x, from column c on.
template <std::size_t Rows, std::size_t Cols, class Factor>
inline void add_outer(Tile<Rows, Cols>& tile, ConstMatrixView x, std::size_t c, Factor factor) {
  for (std::size_t k = 0; k < x.rows(); ++k) {
    const double* from = x.row(k) + c;
    Pair xk[Cols / kPair];
    for (std::size_t p = 0; p < Cols / kPair; ++p) xk[p] = load(from + p * kPair);
    for (std::size_t r = 0; r < Rows; ++r) {
      const double f = factor(r, k);
      const Pair both = {f, f};
      for (std::size_t p = 0; p < Cols / kPair; ++p) tile[r][p] += both * xk[p];
    }
  }
}

/// out[r0.., c0..] += scale a[r0..] x over one full tile.
template <std::size_t Rows, std::size_t Cols>
inline void add_product_tile(double scale, ConstMatrixView a, ConstMatrixView x, MatrixView out, std::size_t r0,
                             std::size_t c0) {
  Tile<Rows, Cols> tile;
  for (std::size_t r = 0; r < Rows; ++r) {
    for (std::size_t p = 0; p < Cols / kPair; ++p) tile[r][p] = load(out.row(r0 + r) + c0 + p * kPair);
  }
  add_outer<Rows, Cols>(tile, x, c0, [&](std::size_t r, std::size_t k) { return scale * a(r0 + r, k); });
  for (std::size_t r = 0; r < Rows; ++r) {
    for (std::size_t p = 0; p < Cols / kPair; ++p) store(out.row(r0 + r) + c0 + p * kPair, tile[r][p]);
  }
}

/// The columns of `Rows` rows of out from c0 on, in tiles of at most Cols.
template <std::size_t Rows, std::size_t Cols>
inline void add_product_rows(double scale, ConstMatrixView a, ConstMatrixView x, MatrixView out, std::size_t r0,
                             std::size_t c0) {
  for (; c0 + Cols <= out.cols(); c0 += Cols) add_product_tile<Rows, Cols>(scale, a, x, out, r0, c0);
  if constexpr (Cols > kTileCols) {
    add_product_rows<Rows, kTileCols>(scale, a, x, out, r0, c0);
  } else {
    for (std::size_t r = r0; r < r0 + Rows; ++r) {
      for (std::size_t k = 0; k < x.rows(); ++k) axpy(scale * a(r, k), x.row(k) + c0, out.row(r) + c0, out.cols() - c0);
    }
  }
}

/// p[i0.., j0..] -= sum_k w[k, i0..]^T w[k, j0..] over one full tile.
inline void subtract_tile(MatrixView p, ConstMatrixView w, std::size_t i0, std::size_t j0) {
  Tile<kTileRows, kTileCols> sum = {};
  add_outer<kTileRows, kTileCols>(sum, w, j0, [&](std::size_t r, std::size_t k) { return w(k, i0 + r); });
  for (std::size_t r = 0; r < kTileRows; ++r) {
    double* to = p.row(i0 + r) + j0;
    for (std::size_t c = 0; c < kTileCols; c += kPair) store(to + c, load(to + c) - sum[r][c / kPair]);
  }
}

/// A Householder reflection along v = (v0, b(:,k)), as scale = 2 / |v|^2, of Width columns of (r, b) from c on.
template <std::size_t Width>
inline void reflect(double* r, MatrixView b, std::size_t k, double v0, double scale, std::size_t c) {
  Pair projection[Width / kPair];
  for (std::size_t p = 0; p < Width / kPair; ++p) projection[p] = v0 * load(r + c + p * kPair);
  for (std::size_t i = 0; i < b.rows(); ++i) {
    const double v = b(i, k);
    const double* from = b.row(i) + c;
    for (std::size_t p = 0; p < Width / kPair; ++p) projection[p] += v * load(from + p * kPair);
  }
  const auto take_off = [&](double v, double* row) {
    const double f = -scale * v;
    for (std::size_t p = 0; p < Width; p += kPair) store(row + p, load(row + p) + f * projection[p / kPair]);
  };
  take_off(v0, r + c);
  for (std::size_t i = 0; i < b.rows(); ++i) take_off(b(i, k), b.row(i) + c);
}

inline void reflect_column(double* r, MatrixView b, std::size_t k, double v0, double scale, std::size_t c) {
  double projection = v0 * r[c];
  for (std::size_t i = 0; i < b.rows(); ++i) projection += b(i, k) * b(i, c);
  r[c] += -scale * v0 * projection;
  for (std::size_t i = 0; i < b.rows(); ++i) b(i, c) += -scale * b(i, k) * projection;
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

void add_product(double scale, ConstMatrixView a, ConstMatrixView x, MatrixView out) {
  PLUMB_ASSERT(a.rows() == out.rows() && a.cols() == x.rows() && x.cols() == out.cols());
  std::size_t r0 = 0;
  for (; r0 + kTileRows <= out.rows(); r0 += kTileRows) add_product_rows<kTileRows, kTileCols>(scale, a, x, out, r0, 0);
  for (; r0 < out.rows(); ++r0) add_product_rows<1, kRowCols>(scale, a, x, out, r0, 0);
}

double dot(const double* a, const double* b, std::size_t n) {
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

void solve_lower_in_place(ConstMatrixView l, MatrixView b) {
  const std::size_t n = l.rows();
  PLUMB_ASSERT(b.rows() == n);
  for (std::size_t i0 = 0; i0 < n; i0 += kTileRows) {
    const std::size_t rows = n - i0 < kTileRows ? n - i0 : kTileRows;
    add_product(-1.0, l.block(i0, 0, rows, i0), b.top(i0), b.block(i0, 0, rows, b.cols()));
    for (std::size_t i = i0; i < i0 + rows; ++i) {
      double* bi = b.row(i);
      for (std::size_t k = i0; k < i; ++k) axpy(-l(i, k), b.row(k), bi, b.cols());
      const double inverse = 1.0 / l(i, i);
      for (std::size_t c = 0; c < b.cols(); ++c) bi[c] *= inverse;
    }
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
  PLUMB_ASSERT(b.cols() == n && columns <= r.rows() && columns <= n);
  constexpr std::size_t kWide = 16;
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
    std::size_t c = k + 1;
    for (; c + kWide <= n; c += kWide) reflect<kWide>(rk, b, k, v0, scale, c);
    for (; c + kTileCols <= n; c += kTileCols) reflect<kTileCols>(rk, b, k, v0, scale, c);
    for (; c < n; ++c) reflect_column(rk, b, k, v0, scale, c);
    for (std::size_t i = 0; i < b.rows(); ++i) b(i, k) = 0.0;
  }
}

}  // namespace plumb
