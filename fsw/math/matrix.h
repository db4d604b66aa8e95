#pragma once
// Views onto row-major matrices that live in static storage, so that every large product in the filter goes through the
// few kernels of kernels.h: no temporaries, no heap, one fixed order of arithmetic.

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <type_traits>

#include "fsw/base/assert.h"

namespace plumb {

/// A rows x cols window on row-major doubles, `stride` elements from row to row. Does not own.
template <typename T>
class BasicMatrixView {
 public:
  BasicMatrixView() = default;
  BasicMatrixView(T* data, std::size_t rows, std::size_t cols, std::size_t stride)
      : data_(data), rows_(rows), cols_(cols), stride_(stride) {}
  /// A writable view reads as a constant one.
  template <typename U>
    requires std::is_convertible_v<U*, T*>
  BasicMatrixView(const BasicMatrixView<U>& other)
      : data_(other.data()), rows_(other.rows()), cols_(other.cols()), stride_(other.stride()) {}

  std::size_t rows() const { return rows_; }
  std::size_t cols() const { return cols_; }
  std::size_t stride() const { return stride_; }
  T* data() const { return data_; }
  T* row(std::size_t r) const { return data_ + r * stride_; }
  T& operator()(std::size_t r, std::size_t c) const { return data_[r * stride_ + c]; }

  BasicMatrixView block(std::size_t r, std::size_t c, std::size_t rows, std::size_t cols) const {
    PLUMB_ASSERT(r + rows <= rows_ && c + cols <= cols_);
    return {data_ + r * stride_ + c, rows, cols, stride_};
  }
  BasicMatrixView top(std::size_t rows) const { return block(0, 0, rows, cols_); }

  /// The same numbers as a small fixed-size Eigen block.
  template <int Rows, int Cols>
  auto fixed(std::size_t r, std::size_t c) const {
    using Matrix = Eigen::Matrix<double, Rows, Cols,
                                 Rows == 1 ? Eigen::RowMajor : (Cols == 1 ? Eigen::ColMajor : Eigen::RowMajor)>;
    using Qualified = std::conditional_t<std::is_const_v<T>, const Matrix, Matrix>;
    using Stride = Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>;
    PLUMB_ASSERT(r + Rows <= rows_ && c + Cols <= cols_);
    const auto s = static_cast<Eigen::Index>(stride_);
    if constexpr (Cols == 1 && Rows != 1) {
      return Eigen::Map<Qualified, Eigen::Unaligned, Stride>(&(*this)(r, c), Stride(s, s));
    } else {
      return Eigen::Map<Qualified, Eigen::Unaligned, Stride>(&(*this)(r, c), Stride(s, 1));
    }
  }

 private:
  T* data_ = nullptr;
  std::size_t rows_ = 0;
  std::size_t cols_ = 0;
  std::size_t stride_ = 0;
};

using MatrixView = BasicMatrixView<double>;
using ConstMatrixView = BasicMatrixView<const double>;

/// Storage for a row-major matrix of fixed capacity; rows start on cache-line boundaries.
template <std::size_t Rows, std::size_t Cols>
class MatrixStorage {
 public:
  static constexpr std::size_t kStride = (Cols + 7) / 8 * 8;
  void clear() { std::fill_n(data_, Rows * kStride, 0.0); }
  MatrixView view() { return {data_, Rows, Cols, kStride}; }
  ConstMatrixView view() const { return {data_, Rows, Cols, kStride}; }
  MatrixView view(std::size_t rows, std::size_t cols) { return view().block(0, 0, rows, cols); }

 private:
  alignas(64) double data_[Rows * kStride] = {};
};

}  // namespace plumb
