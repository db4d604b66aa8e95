#pragma once
// The square-root form of the filter: P = U^T U with U upper triangular, in any precision. P itself is never made, and
// whatever is rounded, U^T U has no negative eigenvalue.
//
// The order of columns is that of sqrtVINS (Peng, Chen and Huang, 2025; github.com/rpng/sqrtVINS): core, poses,
// features. Every new state is then a copy or a linear function of states that stand before it, and a column more
// leaves U triangular. What is added as noise (propagation) or loses its state (a pose that is dropped) becomes a row
// below the triangle, and all of them are folded in by one QR per image. An update of whitened rows, with A = H U^T,
//
//     P+ = U^T (I + A^T A)^-1 U = (N^-1 U)^T (N^-1 U),   N N^T = I + A^T A,   N upper triangular
//
// takes N either from the Householder QR of A under the identity, columns in reverse (Bierman, Factorization Methods
// for Discrete Sequential Estimation, 1977), so that A is never squared, or, as sqrtVINS does, from the Cholesky
// factorisation of I + A^T A, whose eigenvalues are all at least one. With N^-1 A^T r comes the correction.

#include <array>
#include <memory>
#include <span>

#include "test/budget/filter_forms/any_precision_kernels.h"
#include "test/budget/filter_forms/operation.h"

namespace plumb::budget {

/// How N is found.
enum class RootUpdate : std::uint8_t { kHouseholder, kCholesky };

template <typename T, RootUpdate kUpdate>
class RootForm {
 public:
  using Number = T;

  /// False when an update was not possible; it is left out then. By Householder all are possible.
  bool apply(const Operation<T>& operation);
  std::span<const T> correction() const { return {correction_.data(), size_}; }
  Table<long double> covariance() const;

 private:
  static constexpr std::size_t kSize = Layout::kSize;
  static constexpr std::size_t kStride = (kSize + 1 + 15) / 16 * 16;  // room for the residual
  static constexpr std::size_t kNone = kSize;
  static constexpr std::size_t kBlock = 16;  // rows of an update folded at once

  struct Scratch {
    alignas(64) T a[kMaxRows][kStride] = {};
    alignas(64) T n[kSize][kStride] = {};  // rows and columns reversed: by Householder N^T, by Cholesky N
    T along[kSize] = {};                   // N^-1 A^T r, reversed
  };

  /// Row k of U. They stand in memory from the last to the first, as an update goes through them.
  Rows<T> u() { return {u_[kSize - 1], -static_cast<std::ptrdiff_t>(kStride)}; }
  Rows<const T> u() const { return {u_[kSize - 1], -static_cast<std::ptrdiff_t>(kStride)}; }
  Rows<T> reversed() { return {u_[kSize - columns()], kStride}; }
  Rows<T> loose() { return {loose_[0], kStride}; }

  /// The column of a state. Features keep theirs for as long as they live; the flown covariance moves them.
  std::size_t column(std::size_t state) const {
    return state < Layout::kFeatures ? state
                                     : place_[(state - Layout::kFeatures) / kFeatureSize] + state % kFeatureSize;
  }
  std::size_t columns() const;
  std::size_t free_place() const;
  void resize(std::size_t size);
  void restart(const Table<T>& root);
  static void put_root(std::size_t at, const Table<T>& root, Rows<T> to);
  void clear(std::size_t at, std::size_t count);
  void forget(std::size_t first, std::size_t count);
  void move(std::size_t from, std::size_t at);
  void clone(std::size_t from, std::size_t at, std::size_t count);
  void assign(const Operation<T>& operation);
  void propagate(const Operation<T>& operation);
  void triangularise(std::size_t first, std::size_t count);
  T* add_loose();
  void fold_loose();
  bool update(const Operation<T>& operation);
  std::size_t project(const Operation<T>& operation, std::array<std::size_t, kMaxRows>& begins);
  void factor_by_householder(std::size_t rows, std::size_t least, const std::array<std::size_t, kMaxRows>& begins);
  bool factor_by_cholesky(std::size_t rows, std::size_t least, const std::array<std::size_t, kMaxRows>& begins);
  /// Of N^T.
  T factor(std::size_t k, std::size_t i) const {
    return kUpdate == RootUpdate::kHouseholder ? scratch_->n[k][i] : scratch_->n[i][k];
  }
  void divide(std::size_t least);
  void correct(std::size_t least);
  /// Every row there is, those below the triangle too.
  template <class F>
  void for_each_row(F f) {
    for (std::size_t r = 0; r < columns(); ++r) f(u()[r]);
    for (std::size_t r = 0; r < loose_count_; ++r) f(loose_[r]);
  }

  static_assert(Layout::kFeatures % kFeatureSize == 0 && kCoreSize % kFeatureSize == 0);
  std::size_t size_ = 0;
  std::size_t features_ = 0;
  std::array<std::size_t, FlightConfig::kMaxSlamFeatures + 1> place_{};  // first column of each feature
  alignas(64) T u_[kSize][kStride] = {};
  alignas(64) T loose_[kMaxFold][kStride] = {};
  std::size_t loose_count_ = 0;
  std::array<T, kSize> correction_{};
  std::shared_ptr<Scratch> scratch_ = std::make_shared<Scratch>();  ///< copies of the filter share it
};

extern template class RootForm<double, RootUpdate::kHouseholder>;
extern template class RootForm<float, RootUpdate::kHouseholder>;
extern template class RootForm<double, RootUpdate::kCholesky>;
extern template class RootForm<float, RootUpdate::kCholesky>;

}  // namespace plumb::budget
