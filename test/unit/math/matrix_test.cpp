#include "fsw/math/matrix.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace plumb {
namespace {

constexpr std::size_t kRows = 5;
constexpr std::size_t kCols = 11;
using Storage = MatrixStorage<kRows, kCols>;

/// Every element says where it stands: 100 r + c.
void number(MatrixView m) {
  for (std::size_t r = 0; r < m.rows(); ++r) {
    for (std::size_t c = 0; c < m.cols(); ++c) m(r, c) = 100.0 * static_cast<double>(r) + static_cast<double>(c);
  }
}

TEST(Matrix, StorageStartsAtZeroAndClears) {
  Storage storage;
  for (int round = 0; round < 2; ++round) {
    for (std::size_t r = 0; r < kRows; ++r) {
      for (std::size_t c = 0; c < kCols; ++c) EXPECT_EQ(storage.view()(r, c), 0.0);
    }
    number(storage.view());
    storage.clear();
  }
}

TEST(Matrix, RowsStartOnCacheLines) {
  Storage storage;
  EXPECT_EQ(Storage::kStride, 16U);
  for (std::size_t r = 0; r < kRows; ++r) {
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(storage.view().row(r)) % 64, 0U);
  }
}

TEST(Matrix, ElementsDoNotOverlap) {
  Storage storage;
  number(storage.view());
  for (std::size_t r = 0; r < kRows; ++r) {
    for (std::size_t c = 0; c < kCols; ++c) {
      EXPECT_EQ(storage.view()(r, c), 100.0 * static_cast<double>(r) + static_cast<double>(c));
      EXPECT_EQ(storage.view().row(r)[c], storage.view()(r, c));
    }
  }
}

TEST(Matrix, ABlockOfABlockSeesTheSameNumbers) {
  Storage storage;
  number(storage.view());
  const MatrixView block = storage.view().block(1, 2, 4, 8).block(1, 3, 2, 5);
  EXPECT_EQ(block.rows(), 2U);
  EXPECT_EQ(block.cols(), 5U);
  for (std::size_t r = 0; r < block.rows(); ++r) {
    for (std::size_t c = 0; c < block.cols(); ++c) EXPECT_EQ(block(r, c), storage.view()(r + 2, c + 5));
  }
  block(1, 4) = -1.0;
  EXPECT_EQ(storage.view()(3, 9), -1.0);
  EXPECT_EQ(storage.view().top(2).rows(), 2U);
  EXPECT_EQ(storage.view().top(2).cols(), kCols);
  EXPECT_EQ(storage.view(3, 4).rows(), 3U);
  EXPECT_EQ(storage.view(3, 4).cols(), 4U);
}

TEST(Matrix, FixedBlocksReadAndWriteTheSameNumbers) {
  Storage storage;
  const MatrixView m = storage.view();
  number(m);
  const Eigen::Matrix<double, 2, 3> block = m.fixed<2, 3>(1, 4);
  const Eigen::Vector3d column = m.fixed<3, 1>(2, 7);
  const Eigen::RowVector4d row = m.fixed<1, 4>(4, 3);
  EXPECT_EQ(block, (Eigen::Matrix<double, 2, 3>() << 104, 105, 106, 204, 205, 206).finished());
  EXPECT_EQ(column, Eigen::Vector3d(207, 307, 407));
  EXPECT_EQ(row, Eigen::RowVector4d(403, 404, 405, 406));
  m.fixed<3, 1>(0, 10) = Eigen::Vector3d(1, 2, 3);
  m.fixed<2, 2>(3, 0) = Eigen::Matrix2d::Constant(7.0);
  EXPECT_EQ(m(2, 10), 3.0);
  EXPECT_EQ(m(4, 1), 7.0);
  EXPECT_EQ(m(4, 2), 402.0);
}

TEST(Matrix, AWritableViewReadsAsAConstantOne) {
  Storage storage;
  number(storage.view());
  const ConstMatrixView constant = storage.view();
  EXPECT_EQ(constant.data(), storage.view().data());
  EXPECT_EQ(constant(2, 3), 203.0);
  const Eigen::Matrix2d block = constant.fixed<2, 2>(0, 0);
  EXPECT_EQ(block(1, 1), 101.0);
  static_assert(!std::is_convertible_v<ConstMatrixView, MatrixView>);
}

TEST(MatrixDeathTest, ABlockOutsideTheMatrixIsABug) {
  Storage storage;
  EXPECT_DEATH(static_cast<void>(storage.view().block(2, 0, 4, 1)), "");
  EXPECT_DEATH(static_cast<void>(storage.view().block(0, 8, 1, 4)), "");
  EXPECT_DEATH(static_cast<void>(storage.view().fixed<3, 3>(0, 9)), "");
}

}  // namespace
}  // namespace plumb
