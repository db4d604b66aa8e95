#pragma once
// Dense kernels in any precision, cut like those that fly (fsw/math/kernels.cpp): tiles of a result are kept in
// registers, and vectors are 16 bytes wide, so that float32 has twice as many numbers in each as float64.

#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

namespace plumb::budget {

/// Rows of a matrix, `stride` elements from one to the next; a negative stride counts them from the last.
template <typename T>
struct Rows {
  T* first = nullptr;
  std::ptrdiff_t stride = 0;
  T* operator[](std::size_t r) const { return first + static_cast<std::ptrdiff_t>(r) * stride; }
  Rows from(std::size_t r) const { return {(*this)[r], stride}; }
};

template <typename T>
struct Lanes {
  typedef T Vector __attribute__((vector_size(16)));
  static constexpr std::size_t kCount = 16 / sizeof(T);
};
template <>
struct Lanes<long double> {
  using Vector = long double;
  static constexpr std::size_t kCount = 1;
};

#if defined(__aarch64__)
inline constexpr std::size_t kTileVectors = 4;  // of each of four rows
inline constexpr std::size_t kRowVectors = 16;  // of a single row
inline constexpr std::size_t kDotRows = 6;
#else
inline constexpr std::size_t kTileVectors = 2;
inline constexpr std::size_t kRowVectors = 8;
inline constexpr std::size_t kDotRows = 4;
#endif
inline constexpr std::size_t kTileRows = 4;
inline constexpr std::size_t kFoldVectors = 8;
inline constexpr std::size_t kMaxFold = 64;  ///< rows folded at once

template <typename T>
typename Lanes<T>::Vector load(const T* from) {
  typename Lanes<T>::Vector all;
  std::memcpy(&all, from, sizeof all);
  return all;
}
template <typename T>
void store(T* to, typename Lanes<T>::Vector all) {
  std::memcpy(to, &all, sizeof all);
}

/// out[r][c..] += the sum over k of factor(r, k) x[k][c..], over R rows and V vectors.
template <std::size_t R, std::size_t V, typename T, class Factor>
inline void add_tile(Rows<T> out, Rows<const T> x, std::size_t depth, std::size_t c, Factor factor) {
  constexpr std::size_t kLanes = Lanes<T>::kCount;
  typename Lanes<T>::Vector tile[R][V];
  for (std::size_t r = 0; r < R; ++r) {
    for (std::size_t v = 0; v < V; ++v) tile[r][v] = load(out[r] + c + v * kLanes);
  }
#pragma GCC unroll 2
  for (std::size_t k = 0; k < depth; ++k) {
    const T* from = x[k] + c;
    typename Lanes<T>::Vector xk[V];
    for (std::size_t v = 0; v < V; ++v) xk[v] = load(from + v * kLanes);
    for (std::size_t r = 0; r < R; ++r) {
      const T f = factor(r, k);
      for (std::size_t v = 0; v < V; ++v) tile[r][v] += f * xk[v];
    }
  }
  for (std::size_t r = 0; r < R; ++r) {
    for (std::size_t v = 0; v < V; ++v) store(out[r] + c + v * kLanes, tile[r][v]);
  }
}

template <std::size_t R, std::size_t V, typename T, class Factor>
inline void add_columns(Rows<T> out, Rows<const T> x, std::size_t depth, std::size_t c, std::size_t end,
                        Factor factor) {
  for (; c + V * Lanes<T>::kCount <= end; c += V * Lanes<T>::kCount) add_tile<R, V>(out, x, depth, c, factor);
  if constexpr (V > 1) {
    add_columns<R, V / 2>(out, x, depth, c, end, factor);
  } else {
    for (; c < end; ++c) {
      for (std::size_t r = 0; r < R; ++r) {
        T sum = out[r][c];
        for (std::size_t k = 0; k < depth; ++k) sum += factor(r, k) * x[k][c];
        out[r][c] = sum;
      }
    }
  }
}

/// out[r][c] += the sum over k of factor(r, k) x[k][c], for r < rows and begin <= c < end.
template <typename T, class Factor>
void add_product(Rows<T> out, std::size_t rows, Rows<const T> x, std::size_t depth, std::size_t begin, std::size_t end,
                 Factor factor) {
  const auto shifted = [&factor](std::size_t r0) {
    return [&factor, r0](std::size_t r, std::size_t k) { return factor(r0 + r, k); };
  };
  std::size_t r = 0;
  for (; r + kTileRows <= rows; r += kTileRows)
    add_columns<kTileRows, kTileVectors>(out.from(r), x, depth, begin, end, shifted(r));
  for (; r + 2 <= rows; r += 2) add_columns<2, kRowVectors / 2>(out.from(r), x, depth, begin, end, shifted(r));
  for (; r < rows; ++r) add_columns<1, kRowVectors>(out.from(r), x, depth, begin, end, shifted(r));
}

template <std::size_t R, typename T>
inline void dot_tile(Rows<const T> a, const T* b, std::size_t n, T* out) {
  constexpr std::size_t kLanes = Lanes<T>::kCount;
  typename Lanes<T>::Vector sums[R] = {};
  std::size_t i = 0;
  for (; i + kLanes <= n; i += kLanes) {
    const typename Lanes<T>::Vector bi = load(b + i);
    for (std::size_t r = 0; r < R; ++r) sums[r] += load(a[r] + i) * bi;
  }
  for (std::size_t r = 0; r < R; ++r) {
    T parts[kLanes];
    std::memcpy(parts, &sums[r], sizeof parts);
    T sum = 0;
    for (const T part : parts) sum += part;
    for (std::size_t rest = i; rest < n; ++rest) sum += a[r][rest] * b[rest];
    out[r] = sum;
  }
}

/// out[r] = the sum of a[r][i] b[i] over i < n.
template <typename T>
void dot_rows(Rows<const T> a, std::size_t rows, const T* b, std::size_t n, T* out) {
  std::size_t r = 0;
  for (; r + kDotRows <= rows; r += kDotRows) dot_tile<kDotRows>(a.from(r), b, n, out + r);
  for (; r < rows; ++r) dot_tile<1>(a.from(r), b, n, out + r);
}

/// The lower triangle of a <- L with a = L L^T. False when a is not positive definite.
template <typename T>
bool cholesky(Rows<T> a, std::size_t n) {
  const Rows<const T> read{a.first, a.stride};
  T sums[kDotRows];
  for (std::size_t j0 = 0; j0 < n; j0 += kDotRows) {
    const std::size_t rows = n - j0 < kDotRows ? n - j0 : kDotRows;
    for (std::size_t k = 0; k < j0 + rows; ++k) {
      const std::size_t first = k < j0 ? j0 : k;  // of the rows whose column k is made here
      dot_rows(read.from(first), j0 + rows - first, a[k], k, sums);
      if (k >= j0) {
        const T pivot = a[k][k] - sums[0];
        if (!(pivot > 0) || !std::isfinite(pivot)) return false;
        a[k][k] = std::sqrt(pivot);
      }
      for (std::size_t r = k < j0 ? j0 : k + 1; r < j0 + rows; ++r) a[r][k] = (a[r][k] - sums[r - first]) / a[k][k];
    }
  }
  return true;
}

/// b <- L^-1 b, over `cols` columns.
template <typename T>
void solve_lower(Rows<const T> l, std::size_t n, Rows<T> b, std::size_t cols) {
  const Rows<const T> done{b.first, b.stride};
  for (std::size_t i0 = 0; i0 < n; i0 += kTileRows) {
    const std::size_t rows = n - i0 < kTileRows ? n - i0 : kTileRows;
    add_product(b.from(i0), rows, done, i0, 0, cols, [&](std::size_t r, std::size_t k) { return -l[i0 + r][k]; });
    for (std::size_t i = i0; i < i0 + rows; ++i) {
      for (std::size_t k = i0; k < i; ++k) {
        for (std::size_t c = 0; c < cols; ++c) b[i][c] -= l[i][k] * b[k][c];
      }
      const T inverse = 1 / l[i][i];
      for (std::size_t c = 0; c < cols; ++c) b[i][c] *= inverse;
    }
  }
}

/// p <- p - w^T w, both triangles equal.
template <typename T>
void subtract_gram(Rows<T> p, std::size_t n, Rows<const T> w, std::size_t depth) {
  constexpr std::size_t kWidth = kTileVectors * Lanes<T>::kCount;
  for (std::size_t i0 = 0; i0 < n; i0 += kTileRows) {
    const std::size_t rows = n - i0 < kTileRows ? n - i0 : kTileRows;
    const std::size_t tiles_end = (i0 + rows + kWidth - 1) / kWidth * kWidth;
    add_product(p.from(i0), rows, w, depth, 0, tiles_end < n ? tiles_end : n,
                [&](std::size_t r, std::size_t k) { return -w[k][i0 + r]; });
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < i; ++j) p[j][i] = p[i][j];
  }
}

/// Householder reflection along (v0, v), as scale = 2 / |(v0, v)|^2, of the columns of (r, b) from c to end.
template <std::size_t V, typename T>
inline void reflect(T* r, Rows<T> b, std::size_t rows, const T* v, T v0, T scale, std::size_t c, std::size_t end) {
  constexpr std::size_t kLanes = Lanes<T>::kCount;
  for (; c + V * kLanes <= end; c += V * kLanes) {
    typename Lanes<T>::Vector along[V];
    for (std::size_t p = 0; p < V; ++p) along[p] = v0 * load(r + c + p * kLanes);
#pragma GCC unroll 2
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t p = 0; p < V; ++p) along[p] += v[i] * load(b[i] + c + p * kLanes);
    }
    const auto take_off = [&](T f, T* row) {
      typename Lanes<T>::Vector all[V];
      for (std::size_t p = 0; p < V; ++p) all[p] = load(row + p * kLanes);
      for (std::size_t p = 0; p < V; ++p) all[p] += f * along[p];
      for (std::size_t p = 0; p < V; ++p) store(row + p * kLanes, all[p]);
    };
    take_off(-scale * v0, r + c);
#pragma GCC unroll 2
    for (std::size_t i = 0; i < rows; ++i) take_off(-scale * v[i], b[i] + c);
  }
  if constexpr (V > 1) {
    reflect<V / 2>(r, b, rows, v, v0, scale, c, end);
  } else {
    for (; c < end; ++c) {
      T along = v0 * r[c];
      for (std::size_t i = 0; i < rows; ++i) along += v[i] * b[i][c];
      r[c] -= scale * v0 * along;
      for (std::size_t i = 0; i < rows; ++i) b[i][c] -= scale * v[i] * along;
    }
  }
}

/// Folds b into the upper triangle r from column `begin` to `columns`: r^T r grows by b^T b. The columns from there to
/// `width` are carried along. b is zero left of `begin` and is destroyed. At most kMaxFold rows in b.
template <typename T>
void fold(Rows<T> r, Rows<T> b, std::size_t rows, std::size_t begin, std::size_t columns, std::size_t width) {
  constexpr T kNothing = std::numeric_limits<T>::min() / std::numeric_limits<T>::epsilon();  // its square underflows
  T v[kMaxFold];
  for (std::size_t k = begin; k < columns; ++k) {
    T tail = 0;
    for (std::size_t i = 0; i < rows; ++i) {
      v[i] = b[i][k];
      tail += v[i] * v[i];
    }
    if (tail < kNothing) {
      for (std::size_t i = 0; i < rows; ++i) b[i][k] = 0;
      continue;
    }
    T* rk = r[k];
    const T norm = std::sqrt(rk[k] * rk[k] + tail);
    const T alpha = rk[k] > 0 ? -norm : norm;
    const T v0 = rk[k] - alpha;
    const T scale = 2 / (v0 * v0 + tail);
    rk[k] = alpha;
    for (std::size_t i = 0; i < rows; ++i) b[i][k] = 0;
    reflect<kFoldVectors>(rk, b, rows, v, v0, scale, k + 1, width);
  }
}

}  // namespace plumb::budget
