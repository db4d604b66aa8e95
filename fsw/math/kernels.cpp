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
constexpr std::size_t kDotRows = 6;
#else
constexpr std::size_t kTileCols = 4;  // 8 of 16 registers
constexpr std::size_t kRowCols = 16;
constexpr std::size_t kDotRows = 4;
#endif
constexpr std::size_t kFoldCols = 16;

inline Pair load(const double* from) {
  Pair pair;
  std::memcpy(&pair, from, sizeof pair);
  return pair;
}
inline void store(double* to, Pair pair) { std::memcpy(to, &pair, sizeof pair); }

template <std::size_t Rows, std::size_t Cols>
using Tile = Pair[Rows][Cols / kPair];

/// sum += Sign * product. A factor of -1 would be one more instruction.
template <int Sign>
inline void add(Pair& sum, Pair product) {
  static_assert(Sign == 1 || Sign == -1);
  if constexpr (Sign > 0) {
    sum += product;
  } else {
    sum -= product;
  }
}

/// tile += Sign * sum over k of factor(r, k) * row k of x, from column c on.
template <int Sign, std::size_t Rows, std::size_t Cols, class Factor>
inline void add_outer(Tile<Rows, Cols>& tile, ConstMatrixView x, std::size_t c, Factor factor) {
  const std::size_t depth = x.rows();
#pragma GCC unroll 2
  for (std::size_t k = 0; k < depth; ++k) {
    const double* from = x.row(k) + c;
    Pair xk[Cols / kPair];
    for (std::size_t p = 0; p < Cols / kPair; ++p) xk[p] = load(from + p * kPair);
    for (std::size_t r = 0; r < Rows; ++r) {
      const double f = factor(r, k);
      const Pair both = {f, f};
      for (std::size_t p = 0; p < Cols / kPair; ++p) add<Sign>(tile[r][p], both * xk[p]);
    }
  }
}

/// out[r0.., c0..] += Sign a[r0..] x over one full tile.
template <int Sign, std::size_t Rows, std::size_t Cols>
inline void add_product_tile(ConstMatrixView a, ConstMatrixView x, MatrixView out, std::size_t r0, std::size_t c0) {
  Tile<Rows, Cols> tile;
  for (std::size_t r = 0; r < Rows; ++r) {
    for (std::size_t p = 0; p < Cols / kPair; ++p) tile[r][p] = load(out.row(r0 + r) + c0 + p * kPair);
  }
  add_outer<Sign, Rows, Cols>(tile, x, c0, [&](std::size_t r, std::size_t k) { return a(r0 + r, k); });
  for (std::size_t r = 0; r < Rows; ++r) {
    for (std::size_t p = 0; p < Cols / kPair; ++p) store(out.row(r0 + r) + c0 + p * kPair, tile[r][p]);
  }
}

/// The same of one column.
template <int Sign, std::size_t Rows>
inline void add_product_column(ConstMatrixView a, ConstMatrixView x, MatrixView out, std::size_t r0, std::size_t c) {
  double column[Rows];
  for (std::size_t r = 0; r < Rows; ++r) column[r] = out(r0 + r, c);
  for (std::size_t k = 0; k < x.rows(); ++k) {
    for (std::size_t r = 0; r < Rows; ++r) column[r] += Sign * a(r0 + r, k) * x(k, c);
  }
  for (std::size_t r = 0; r < Rows; ++r) out(r0 + r, c) = column[r];
}

/// The columns of `Rows` rows of out from c0 on, in tiles of at most Cols.
template <int Sign, std::size_t Rows, std::size_t Cols>
inline void add_product_rows(ConstMatrixView a, ConstMatrixView x, MatrixView out, std::size_t r0, std::size_t c0) {
  for (; c0 + Cols <= out.cols(); c0 += Cols) add_product_tile<Sign, Rows, Cols>(a, x, out, r0, c0);
  if constexpr (Cols > kPair) {
    add_product_rows<Sign, Rows, Cols / 2>(a, x, out, r0, c0);
  } else if (c0 < out.cols()) {
    add_product_column<Sign, Rows>(a, x, out, r0, c0);
  }
}

template <int Sign>
inline void accumulate_product(ConstMatrixView a, ConstMatrixView x, MatrixView out) {
  PLUMB_ASSERT(a.rows() == out.rows() && a.cols() == x.rows() && x.cols() == out.cols());
  std::size_t r0 = 0;
  for (; r0 + kTileRows <= out.rows(); r0 += kTileRows) {
    add_product_rows<Sign, kTileRows, kTileCols>(a, x, out, r0, 0);
  }
  for (; r0 + 2 <= out.rows(); r0 += 2) add_product_rows<Sign, 2, kRowCols / 2>(a, x, out, r0, 0);
  for (; r0 < out.rows(); ++r0) add_product_rows<Sign, 1, kRowCols>(a, x, out, r0, 0);
}

/// out[r] = dot(a.row(r), b, n) for Rows rows from r0 on, summed as dot() does.
template <std::size_t Rows>
inline void dot_tile(ConstMatrixView a, const double* b, std::size_t n, std::size_t r0, double* out) {
  Pair low[Rows] = {};
  Pair high[Rows] = {};
  const double* rows[Rows];
  for (std::size_t r = 0; r < Rows; ++r) rows[r] = a.row(r0 + r);
  std::size_t i = 0;
#pragma GCC unroll 2
  for (; i + 4 <= n; i += 4) {
    const Pair b_low = load(b + i);
    const Pair b_high = load(b + i + kPair);
    for (std::size_t r = 0; r < Rows; ++r) {
      low[r] += load(rows[r] + i) * b_low;
      high[r] += load(rows[r] + i + kPair) * b_high;
    }
  }
  double first[Rows];
  for (std::size_t r = 0; r < Rows; ++r) first[r] = low[r][0];
  for (; i < n; ++i) {
    for (std::size_t r = 0; r < Rows; ++r) first[r] += rows[r][i] * b[i];
  }
  for (std::size_t r = 0; r < Rows; ++r) out[r] = (first[r] + low[r][1]) + (high[r][0] + high[r][1]);
}

/// p[i0.., j0..] -= sum_k w[k, i0..]^T w[k, j0..] over one full tile.
template <std::size_t Rows>
inline void subtract_tile(MatrixView p, ConstMatrixView w, std::size_t i0, std::size_t j0) {
  Tile<Rows, kTileCols> sum = {};
  add_outer<1, Rows, kTileCols>(sum, w, j0, [&](std::size_t r, std::size_t k) { return w(k, i0 + r); });
  for (std::size_t r = 0; r < Rows; ++r) {
    double* to = p.row(i0 + r) + j0;
    for (std::size_t c = 0; c < kTileCols; c += kPair) store(to + c, load(to + c) - sum[r][c / kPair]);
  }
}

/// The rows of p from i0 on, up to the diagonal and, where there is room for a tile, beyond.
template <std::size_t Rows>
inline void subtract_rows(MatrixView p, ConstMatrixView w, std::size_t i0) {
  std::size_t j0 = 0;
  for (; j0 < i0 + Rows && j0 + kTileCols <= p.cols(); j0 += kTileCols) subtract_tile<Rows>(p, w, i0, j0);
  for (std::size_t i = i0; i < i0 + Rows; ++i) {
    for (std::size_t j = j0; j <= i; ++j) {
      double sum = 0.0;
      for (std::size_t k = 0; k < w.rows(); ++k) sum += w(k, i) * w(k, j);
      p(i, j) -= sum;
    }
  }
}

/// A Householder reflection along (v0, v), as scale = 2 / |(v0, v)|^2, of Width columns of (r, b) from c on.
template <std::size_t Width>
inline void reflect(double* r, MatrixView b, const double* v, double v0, double scale, std::size_t c) {
  constexpr std::size_t kPairs = Width / kPair;
  const std::size_t rows = b.rows();
  Pair projection[kPairs];
  for (std::size_t p = 0; p < kPairs; ++p) projection[p] = v0 * load(r + c + p * kPair);
#pragma GCC unroll 2
  for (std::size_t i = 0; i < rows; ++i) {
    const double* from = b.row(i) + c;
    for (std::size_t p = 0; p < kPairs; ++p) projection[p] += v[i] * load(from + p * kPair);
  }
  const auto take_off = [&](double along, double* row) {
    const double f = -scale * along;
    Pair all[kPairs];  // loaded before the first is stored: the compiler need not fear that they overlap
    for (std::size_t p = 0; p < kPairs; ++p) all[p] = load(row + p * kPair);
    for (std::size_t p = 0; p < kPairs; ++p) all[p] += f * projection[p];
    for (std::size_t p = 0; p < kPairs; ++p) store(row + p * kPair, all[p]);
  };
  take_off(v0, r + c);
#pragma GCC unroll 2
  for (std::size_t i = 0; i < rows; ++i) take_off(v[i], b.row(i) + c);
}

inline void reflect_column(double* r, MatrixView b, const double* v, double v0, double scale, std::size_t c) {
  double projection = v0 * r[c];
  for (std::size_t i = 0; i < b.rows(); ++i) projection += v[i] * b(i, c);
  r[c] += -scale * v0 * projection;
  for (std::size_t i = 0; i < b.rows(); ++i) b(i, c) += -scale * v[i] * projection;
}

/// The same of all columns from c on.
template <std::size_t Width>
inline void reflect_from(double* r, MatrixView b, const double* v, double v0, double scale, std::size_t c) {
  for (; c + Width <= b.cols(); c += Width) reflect<Width>(r, b, v, v0, scale, c);
  if constexpr (Width > kPair) {
    reflect_from<Width / 2>(r, b, v, v0, scale, c);
  } else if (c < b.cols()) {
    reflect_column(r, b, v, v0, scale, c);
  }
}

}  // namespace

Status cholesky_in_place(MatrixView a) {
  const std::size_t n = a.rows();
  PLUMB_ASSERT(a.cols() >= n);
  for (std::size_t j0 = 0; j0 < n; j0 += kDotRows) {
    // Several rows go through the columns left of their own diagonals together.
    const std::size_t rows = n - j0 < kDotRows ? n - j0 : kDotRows;
    double sums[kDotRows];
    for (std::size_t k = 0; k < j0; ++k) {
      dot_rows(a.block(j0, 0, rows, k), a.row(k), sums);
      for (std::size_t r = 0; r < rows; ++r) a(j0 + r, k) = (a(j0 + r, k) - sums[r]) / a(k, k);
    }
    for (std::size_t j = j0; j < j0 + rows; ++j) {
      double* aj = a.row(j);
      for (std::size_t k = j0; k < j; ++k) aj[k] = (aj[k] - dot(aj, a.row(k), k)) / a(k, k);
      const double pivot = aj[j] - dot(aj, aj, j);
      if (!(pivot > 0.0) || !std::isfinite(pivot)) return Status::kNumericalFault;
      aj[j] = std::sqrt(pivot);
    }
  }
  return Status::kOk;
}

void add_product(ConstMatrixView a, ConstMatrixView x, MatrixView out) { accumulate_product<1>(a, x, out); }

void subtract_product(ConstMatrixView a, ConstMatrixView x, MatrixView out) { accumulate_product<-1>(a, x, out); }

double dot(const double* a, const double* b, std::size_t n) {
  // Four running sums in a fixed order: vectorises without leave to reorder.
  double sum = 0.0;
  dot_tile<1>({a, 1, n, n}, b, n, 0, &sum);
  return sum;
}

void dot_rows(ConstMatrixView a, const double* b, double* out) {
  std::size_t r = 0;
  for (; r + kDotRows <= a.rows(); r += kDotRows) dot_tile<kDotRows>(a, b, a.cols(), r, out + r);
  for (; r + 2 <= a.rows(); r += 2) dot_tile<2>(a, b, a.cols(), r, out + r);
  for (; r < a.rows(); ++r) dot_tile<1>(a, b, a.cols(), r, out + r);
}

void solve_lower_in_place(ConstMatrixView l, MatrixView b) {
  const std::size_t n = l.rows();
  PLUMB_ASSERT(b.rows() == n);
  for (std::size_t i0 = 0; i0 < n; i0 += kTileRows) {
    const std::size_t rows = n - i0 < kTileRows ? n - i0 : kTileRows;
    subtract_product(l.block(i0, 0, rows, i0), b.top(i0), b.block(i0, 0, rows, b.cols()));
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
  for (; i0 + kTileRows <= n; i0 += kTileRows) subtract_rows<kTileRows>(p, w, i0);
  for (; i0 < n; ++i0) subtract_rows<1>(p, w, i0);
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
  PLUMB_ASSERT(b.cols() == n && columns <= r.rows() && columns <= n && b.rows() <= kMaxFoldRows);
  double v[kMaxFoldRows];
  for (std::size_t k = 0; k < columns; ++k) {
    // Reflection of the column (r(k,k), b(:,k)) onto its first axis, along (v0, v).
    double tail = 0.0;
    for (std::size_t i = 0; i < b.rows(); ++i) {
      v[i] = b(i, k);
      tail += v[i] * v[i];
    }
    if (tail == 0.0) continue;
    double* rk = r.row(k);
    const double norm = std::sqrt(rk[k] * rk[k] + tail);
    const double alpha = rk[k] > 0.0 ? -norm : norm;
    const double v0 = rk[k] - alpha;
    const double scale = 2.0 / (v0 * v0 + tail);
    rk[k] = alpha;
    for (std::size_t i = 0; i < b.rows(); ++i) b(i, k) = 0.0;
    reflect_from<kFoldCols>(rk, b, v, v0, scale, k + 1);
  }
}

}  // namespace plumb
