#pragma once
// The covariance form of the filter: P itself, as it flies. Once with the kernels that fly, and once in any precision.

#include <array>
#include <memory>
#include <span>

#include "fsw/estimator/covariance.h"
#include "fsw/math/kernels.h"
#include "test/budget/filter_forms/any_precision_kernels.h"
#include "test/budget/filter_forms/operation.h"

namespace plumb::budget {

/// The very functions that fly, in their order (UpdateStack::apply).
class FlownForm {
 public:
  using Number = double;

  /// False when an update was not possible; it is left out then.
  bool apply(const Operation<double>& operation);
  /// Of the last update.
  std::span<const double> correction() const { return {correction_.data(), size_}; }
  Table<long double> covariance() const;

 private:
  MatrixView p() { return p_.view(size_, size_); }
  bool update(const Operation<double>& operation);

  struct Scratch {
    MatrixStorage<kMaxRows, Layout::kSize> hp;
    MatrixStorage<kMaxRows, kMaxRows> s;
  };
  std::size_t size_ = 0;
  MatrixStorage<Layout::kSize, Layout::kSize> p_;
  std::array<double, Layout::kSize> correction_{};
  std::shared_ptr<Scratch> scratch_ = std::make_shared<Scratch>();  ///< copies of the filter share it
};

template <typename T>
class CovarianceForm {
 public:
  using Number = T;

  bool apply(const Operation<T>& operation);
  std::span<const T> correction() const { return {correction_.data(), size_}; }
  Table<long double> covariance() const {
    Table<long double> out(index(size_), index(size_));
    for (std::size_t r = 0; r < size_; ++r) {
      for (std::size_t c = 0; c < size_; ++c) out(index(r), index(c)) = p_[r][c];
    }
    return out;
  }

 private:
  static constexpr std::size_t kStride = (Layout::kSize + 15) / 16 * 16;

  struct Scratch {
    alignas(64) T hp[kMaxRows][kStride] = {};
    alignas(64) T s[kMaxRows][kMaxRows] = {};
  };
  Rows<T> p() { return {p_[0], kStride}; }
  Rows<T> hp() { return {scratch_->hp[0], kStride}; }
  void clear(std::size_t at, std::size_t count);
  void clone(std::size_t from, std::size_t at, std::size_t count);
  void assign(const Operation<T>& operation);
  void propagate(const Operation<T>& operation);
  bool update(const Operation<T>& operation);
  void multiply(const Operation<T>& operation, std::size_t first, std::size_t rows);

  std::size_t size_ = 0;
  alignas(64) T p_[Layout::kSize][kStride] = {};
  std::array<T, Layout::kSize> correction_{};
  std::shared_ptr<Scratch> scratch_ = std::make_shared<Scratch>();  ///< copies of the filter share it
};

template <typename T>
bool CovarianceForm<T>::apply(const Operation<T>& operation) {
  size_ = operation.size;
  switch (operation.kind) {
    case Kind::kRestart: clear(0, size_); [[fallthrough]];
    case Kind::kPrior:
      for (Eigen::Index r = 0; r < operation.a.rows(); ++r) {
        std::copy_n(&operation.a(r, 0), operation.a.cols(),
                    p_[operation.at + static_cast<std::size_t>(r)] + operation.at);
      }
      return true;
    case Kind::kClear: clear(operation.at, operation.count); return true;
    case Kind::kClone: clone(operation.from, operation.at, operation.count); return true;
    case Kind::kMove:
      clone(operation.from, operation.at, operation.count);
      clear(operation.from, operation.count);
      return true;
    case Kind::kAssign: assign(operation); return true;
    case Kind::kPropagate: propagate(operation); return true;
    case Kind::kUpdate: return update(operation);
  }
  return false;
}

template <typename T>
void CovarianceForm<T>::clear(std::size_t at, std::size_t count) {
  for (std::size_t k = at; k < at + count; ++k) {
    for (std::size_t c = 0; c < size_; ++c) p_[k][c] = p_[c][k] = 0;
  }
}

template <typename T>
void CovarianceForm<T>::clone(std::size_t from, std::size_t at, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k) std::copy_n(p_[from + k], size_, p_[at + k]);
  for (std::size_t r = 0; r < size_; ++r) std::copy_n(p_[r] + from, count, p_[r] + at);
}

/// hp[first..] <- a[first..] P, all rows within the support of the first.
template <typename T>
void CovarianceForm<T>::multiply(const Operation<T>& operation, std::size_t first, std::size_t rows) {
  for (std::size_t r = first; r < first + rows; ++r) std::fill_n(hp()[r], size_, T(0));
  for (const Segment& s : operation.supports[first]) {
    add_product(hp().from(first), rows, Rows<const T>{p_[s.start], kStride}, s.length, 0, size_,
                [&](std::size_t r, std::size_t k) { return operation.a(index(first + r), index(s.start + k)); });
  }
}

template <typename T>
void CovarianceForm<T>::assign(const Operation<T>& operation) {
  const auto rows = static_cast<std::size_t>(operation.a.rows());
  multiply(operation, 0, rows);
  Table<T> square = operation.b;
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t q = 0; q < rows; ++q) {
      for (const Segment& s : operation.supports.front()) {
        for (std::size_t k = s.start; k < s.start + s.length; ++k)
          square(index(r), index(q)) += hp()[r][k] * operation.a(index(q), index(k));
      }
    }
  }
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < size_; ++c) p_[operation.at + r][c] = p_[c][operation.at + r] = hp()[r][c];
  }
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t q = 0; q < rows; ++q)
      p_[operation.at + r][operation.at + q] = (square(index(r), index(q)) + square(index(q), index(r))) / 2;
  }
}

template <typename T>
void CovarianceForm<T>::propagate(const Operation<T>& operation) {
  const Table<T>& phi = operation.a;
  for (std::size_t r = 0; r < kCoreSize; ++r) {
    std::fill_n(hp()[r], size_, T(0));
    for (std::size_t k = 0; k < kCoreSize; ++k) {
      const T f = phi(index(r), index(k));
      if (f == 0) continue;
      for (std::size_t c = 0; c < size_; ++c) hp()[r][c] += f * p_[k][c];
    }
  }
  T core[kCoreSize][kCoreSize];
  for (std::size_t r = 0; r < kCoreSize; ++r) {
    for (std::size_t c = 0; c < kCoreSize; ++c) {
      core[r][c] = operation.b(index(r), index(c));
      for (std::size_t k = 0; k < kCoreSize; ++k) core[r][c] += hp()[r][k] * phi(index(c), index(k));
    }
  }
  for (std::size_t r = 0; r < kCoreSize; ++r) {
    for (std::size_t c = 0; c < kCoreSize; ++c) p_[r][c] = (core[r][c] + core[c][r]) / 2;
    for (std::size_t c = kCoreSize; c < size_; ++c) p_[r][c] = p_[c][r] = hp()[r][c];
  }
}

template <typename T>
bool CovarianceForm<T>::update(const Operation<T>& operation) {
  const std::size_t rows = operation.residual.size();
  std::fill_n(correction_.begin(), size_, T(0));
  std::size_t first = 0;
  for (const std::size_t count : operation.groups) {
    multiply(operation, first, count);
    first += count;
  }
  T part[kMaxRows];
  const Rows<T> s{scratch_->s[0], kMaxRows};
  for (std::size_t j = 0; j < rows; ++j) {
    for (std::size_t i = j; i < rows; ++i) s[i][j] = i == j ? 1 : 0;
    for (const Segment& seen : operation.supports[j]) {
      dot_rows(Rows<const T>{hp()[j] + seen.start, kStride}, rows - j, &operation.a(index(j), index(seen.start)),
               seen.length, part);
      for (std::size_t i = j; i < rows; ++i) s[i][j] += part[i - j];
    }
  }
  if (!cholesky(s, rows)) return false;
  T y[kMaxRows];
  std::copy(operation.residual.begin(), operation.residual.end(), y);
  const Rows<const T> l{s[0], kMaxRows};
  solve_lower(l, rows, hp(), size_);
  solve_lower(l, rows, Rows<T>{y, 1}, 1);
  for (std::size_t k = 0; k < rows; ++k) {
    for (std::size_t c = 0; c < size_; ++c) correction_[c] += y[k] * hp()[k][c];
  }
  subtract_gram(p(), size_, Rows<const T>{hp()[0], kStride}, rows);
  return true;
}

}  // namespace plumb::budget
