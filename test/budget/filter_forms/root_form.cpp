#include "test/budget/filter_forms/root_form.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace plumb::budget {

template <typename T, RootUpdate kUpdate>
bool RootForm<T, kUpdate>::apply(const Operation<T>& operation) {
  if (operation.kind == Kind::kRestart) {
    size_ = operation.size;
    restart(operation.root);
    return true;
  }
  resize(operation.size);
  switch (operation.kind) {
    case Kind::kRestart: break;
    case Kind::kPrior: put_root(column(operation.at), upper_root(operation.a), u()); break;
    case Kind::kClear: clear(operation.at, operation.count); break;
    case Kind::kClone: clone(operation.from, operation.at, operation.count); break;
    case Kind::kMove: move(operation.from, operation.at); break;
    case Kind::kAssign: assign(operation); break;
    case Kind::kPropagate: propagate(operation); break;
    case Kind::kUpdate: return update(operation);
  }
  return true;
}

template <typename T, RootUpdate kUpdate>
std::size_t RootForm<T, kUpdate>::columns() const {
  std::size_t end = Layout::kFeatures;
  for (std::size_t i = 0; i < features_; ++i) {
    if (place_[i] != kNone) end = std::max(end, place_[i] + kFeatureSize);
  }
  return end;
}

/// Features behind the new size are forgotten; new ones get the first free columns, which are zero.
template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::resize(std::size_t size) {
  size_ = size;
  const std::size_t wanted = (size - Layout::kFeatures) / kFeatureSize;
  while (features_ > wanted) {
    if (place_[features_ - 1] != kNone) forget(place_[features_ - 1], kFeatureSize);
    --features_;
  }
  while (features_ < wanted) {
    place_[features_] = free_place();
    ++features_;
  }
}

template <typename T, RootUpdate kUpdate>
std::size_t RootForm<T, kUpdate>::free_place() const {
  const auto end = place_.begin() + static_cast<std::ptrdiff_t>(features_);
  std::size_t place = Layout::kFeatures;
  while (std::find(place_.begin(), end, place) != end) place += kFeatureSize;
  return place;
}

template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::restart(const Table<T>& root) {
  std::fill_n(u_[0], kSize * kStride, T(0));
  loose_count_ = 0;
  features_ = 0;
  resize(size_);
  put_root(0, root, u());
}

/// Rows at.. of `to` <- root, in columns at...
template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::put_root(std::size_t at, const Table<T>& root, Rows<T> to) {
  for (Eigen::Index k = 0; k < root.rows(); ++k)
    std::copy_n(&root(k, 0), root.cols(), to[at + static_cast<std::size_t>(k)] + at);
}

template <typename T, RootUpdate kUpdate>
T* RootForm<T, kUpdate>::add_loose() {
  if (loose_count_ == kMaxFold) fold_loose();
  T* row = loose_[loose_count_++];
  std::fill_n(row, kStride, T(0));
  return row;
}

template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::fold_loose() {
  const std::size_t end = columns();
  const std::size_t rows = loose_count_;
  loose_count_ = 0;
  fold(u(), loose(), rows, 0, end, end);
}

/// The columns first.. leave the filter. Their rows, which others may depend on, become rows below the triangle.
template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::forget(std::size_t first, std::size_t count) {
  const std::size_t end = columns();
  for_each_row([&](T* row) { std::fill_n(row + first, count, T(0)); });
  for (std::size_t k = first; k < first + count; ++k) {
    T* row = u()[k];
    if (std::all_of(row + k, row + end, [](T value) { return value == 0; })) continue;
    std::copy_n(row, end, add_loose());
    std::fill_n(row, end, T(0));
  }
}

template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::clear(std::size_t at, std::size_t count) {
  if (at >= Layout::kFeatures) {
    std::size_t& place = place_[(at - Layout::kFeatures) / kFeatureSize];
    if (place == kNone) place = free_place();  // its feature has moved
  }
  for (std::size_t i = 0; i < count; i += kFeatureSize) forget(column(at + i), kFeatureSize);
}

/// Of a feature: only its number changes.
template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::move(std::size_t from, std::size_t at) {
  clear(at, kFeatureSize);
  std::size_t& left = place_[(from - Layout::kFeatures) / kFeatureSize];
  place_[(at - Layout::kFeatures) / kFeatureSize] = left;
  left = kNone;
}

/// Into columns to the right of those that are copied.
template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::clone(std::size_t from, std::size_t at, std::size_t count) {
  clear(at, count);
  for_each_row([&](T* row) { std::copy_n(row + from, count, row + at); });
}

/// Rows first.. are full in columns first..: makes them triangular again.
template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::triangularise(std::size_t first, std::size_t count) {
  const std::size_t end = columns();
  for (std::size_t k = first; k + 1 < first + count; ++k) {
    // The rows below, from the last on: fold() wants them one stride apart.
    const std::size_t below = first + count - k - 1;
    fold(u(), Rows<T>{u()[k + 1], u().stride}, below, k, k + 1, end);
  }
}

template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::assign(const Operation<T>& operation) {
  const std::size_t at = column(operation.at);
  const Support& support = operation.supports.front();
  for_each_row([&](T* row) {
    T value[kFeatureSize] = {};
    for (const Segment& s : support) {
      const T* from = row + column(s.start);
      for (std::size_t q = 0; q < kFeatureSize; ++q) {
        for (std::size_t k = 0; k < s.length; ++k) value[q] += operation.a(index(q), index(s.start + k)) * from[k];
      }
    }
    std::copy_n(value, kFeatureSize, row + at);
  });
  if (u()[at][at] == 0) {  // a new state: its rows are free for its noise
    put_root(at, operation.root, u());
    return;
  }
  triangularise(at, kFeatureSize);
}

template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::propagate(const Operation<T>& operation) {
  const auto multiply = [&operation](T* row) {
    T moved[kCoreSize] = {};
    for (std::size_t r = 0; r < kCoreSize; ++r) {
      for (std::size_t k = 0; k < kCoreSize; ++k) moved[r] += operation.a(index(r), index(k)) * row[k];
    }
    std::copy_n(moved, kCoreSize, row);
  };
  for (std::size_t r = 0; r < kCoreSize; ++r) multiply(u()[r]);  // further down the core's columns are zero
  for (std::size_t r = 0; r < loose_count_; ++r) multiply(loose_[r]);
  triangularise(0, kCoreSize);
  if (loose_count_ + kCoreSize > kMaxFold) fold_loose();
  const std::size_t first = loose_count_;
  for (std::size_t k = 0; k < kCoreSize; ++k) add_loose();
  put_root(0, upper_root(operation.b), loose().from(first));
}

/// A = H U^T, columns in reverse, each row with its residual behind the last; `begins`: the first column of each row
/// that is not zero. Returns the least of them.
template <typename T, RootUpdate kUpdate>
std::size_t RootForm<T, kUpdate>::project(const Operation<T>& operation, std::array<std::size_t, kMaxRows>& begins) {
  const std::size_t n = columns();
  const Rows<const T> roots{reversed().first, kStride};
  std::size_t least = n;
  T part[kSize];
  for (std::size_t i = 0; i < operation.residual.size(); ++i) {
    T* row = scratch_->a[i];
    std::fill_n(row, n, T(0));
    row[n] = operation.residual[i];
    begins[i] = n;
    for (const Segment& s : operation.supports[i]) {
      const std::size_t from = column(s.start);
      const std::size_t begin = n - from - s.length;  // rows of U further down are zero there
      dot_rows(Rows<const T>{roots[begin] + from, kStride}, n - begin, &operation.a(index(i), index(s.start)), s.length,
               part);
      for (std::size_t r = begin; r < n; ++r) row[r] += part[r - begin];
      begins[i] = std::min(begins[i], begin);
    }
    least = std::min(least, begins[i]);
  }
  return least;
}

/// N^T, reversed, from the identity over A; the residual becomes N^-1 A^T r.
template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::factor_by_householder(std::size_t rows, std::size_t least,
                                                 const std::array<std::size_t, kMaxRows>& begins) {
  const std::size_t n = columns();
  for (std::size_t k = least; k < n; ++k) {
    std::fill_n(scratch_->n[k] + k, n + 1 - k, T(0));
    scratch_->n[k][k] = 1;
  }
  const Rows<T> triangle{scratch_->n[0], kStride};
  for (std::size_t first = 0; first < rows; first += kBlock) {
    const std::size_t count = std::min(kBlock, rows - first);
    const std::size_t begin = *std::min_element(begins.begin() + first, begins.begin() + first + count);
    fold(triangle, Rows<T>{scratch_->a[first], kStride}, count, begin, n, n + 1);
  }
  for (std::size_t k = least; k < n; ++k) scratch_->along[k] = triangle[k][n];
}

/// N, reversed and so lower triangular, from I + A^T A.
template <typename T, RootUpdate kUpdate>
bool RootForm<T, kUpdate>::factor_by_cholesky(std::size_t rows, std::size_t least,
                                              const std::array<std::size_t, kMaxRows>& begins) {
  const std::size_t n = columns();
  const Rows<T> gram{scratch_->n[0], kStride};
  for (std::size_t i = least; i < n; ++i) {
    std::fill_n(gram[i] + least, i + 1 - least, T(0));
    gram[i][i] = 1;
    scratch_->along[i] = 0;
  }
  for (std::size_t first = 0, count = 0; first < rows; first += count) {
    // As many rows as see the same columns; those of features are taken together, each sees some columns more.
    count = 1;
    while (first + count < rows && (count < kBlock || begins[first + count] == begins[first])) ++count;
    const std::size_t begin = *std::min_element(begins.begin() + first, begins.begin() + first + count);
    const Rows<const T> a{scratch_->a[first], kStride};
    for (std::size_t i0 = begin; i0 < n; i0 += kTileRows) {
      const std::size_t tile = std::min(kTileRows, n - i0);
      add_product(gram.from(i0), tile, a, count, begin, std::min(i0 + kTileRows, n),
                  [&](std::size_t r, std::size_t k) { return a[k][i0 + r]; });
    }
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t i = begin; i < n; ++i) scratch_->along[i] += a[k][n] * a[k][i];
    }
  }
  const Rows<T> used{gram[least] + least, kStride};
  if (!cholesky(used, n - least)) return false;
  solve_lower(Rows<const T>{used.first, kStride}, n - least, Rows<T>{scratch_->along + least, 1}, 1);
  return true;
}

/// U <- N^-1 U.
template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::divide(std::size_t least) {
  const std::size_t n = columns();
  const Rows<T> rows = reversed();
  for (std::size_t i0 = least; i0 < n; i0 += kTileRows) {
    const std::size_t count = std::min(kTileRows, n - i0);
    for (std::size_t k0 = least; k0 < i0; k0 += kBlock) {
      const std::size_t depth = std::min(kBlock, i0 - k0);
      add_product(rows.from(i0), count, Rows<const T>{rows[k0], kStride}, depth, n - k0 - depth, n,
                  [&](std::size_t r, std::size_t k) { return -factor(k0 + k, i0 + r); });
    }
    for (std::size_t i = i0; i < i0 + count; ++i) {
      T* row = rows[i];
      for (std::size_t k = i0; k < i; ++k) {
        const T f = factor(k, i);
        const T* __restrict from = rows[k];
        for (std::size_t c = n - 1 - k; c < n; ++c) row[c] -= f * from[c];
      }
      const T inverse = 1 / factor(i, i);
      for (std::size_t c = n - 1 - i; c < n; ++c) row[c] *= inverse;
    }
  }
}

template <typename T, RootUpdate kUpdate>
void RootForm<T, kUpdate>::correct(std::size_t least) {
  const std::size_t n = columns();
  T moved[kSize] = {};
  for (std::size_t k = least; k < n; ++k) {
    const T along = scratch_->along[k];
    const T* __restrict row = reversed()[k];
    for (std::size_t c = n - 1 - k; c < n; ++c) moved[c] += along * row[c];
  }
  for (std::size_t i = 0; i < size_; ++i) correction_[i] = moved[column(i)];
}

template <typename T, RootUpdate kUpdate>
bool RootForm<T, kUpdate>::update(const Operation<T>& operation) {
  fold_loose();
  std::array<std::size_t, kMaxRows> begins{};
  const std::size_t rows = operation.residual.size();
  const std::size_t least = project(operation, begins);
  if constexpr (kUpdate == RootUpdate::kHouseholder) {
    factor_by_householder(rows, least, begins);
  } else {
    if (!factor_by_cholesky(rows, least, begins)) return false;
  }
  divide(least);
  correct(least);
  return true;
}

template <typename T, RootUpdate kUpdate>
Table<long double> RootForm<T, kUpdate>::covariance() const {
  const std::size_t n = columns();
  Table<long double> rows(index(n + loose_count_), index(size_));
  for (std::size_t i = 0; i < size_; ++i) {
    for (std::size_t r = 0; r < n; ++r) rows(index(r), index(i)) = u()[r][column(i)];
    for (std::size_t r = 0; r < loose_count_; ++r) rows(index(n + r), index(i)) = loose_[r][column(i)];
  }
  return rows.transpose() * rows;
}

template class RootForm<double, RootUpdate::kHouseholder>;
template class RootForm<float, RootUpdate::kHouseholder>;
template class RootForm<double, RootUpdate::kCholesky>;
template class RootForm<float, RootUpdate::kCholesky>;

}  // namespace plumb::budget
