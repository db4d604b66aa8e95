#include "fsw/math/kernels.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <limits>
#include <vector>

#include "test/support/dense.h"

namespace plumb {
namespace {

using test::Dense;
using test::dense;
using test::difference;
using test::index;
using test::store;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMaxSize = 70;
using Storage = MatrixStorage<kMaxSize + 2, kMaxSize + 2>;

/// A window of this shape inside storage full of not-a-number: a kernel that reads past its view is found out.
MatrixView window(Storage& storage, std::size_t rows, std::size_t cols) {
  store(Dense::Constant(kMaxSize + 2, kMaxSize + 2, kNaN), storage.view());
  return storage.view().block(1, 1, rows, cols);
}

std::size_t any_size(test::Generator& g, std::size_t low, std::size_t high) {
  return static_cast<std::size_t>(g.integer(static_cast<std::int64_t>(low), static_cast<std::int64_t>(high)));
}

Dense gram(const Dense& a) { return a.transpose() * a; }

void expect_upper_triangular(ConstMatrixView a, std::size_t columns) {
  for (std::size_t c = 0; c < columns; ++c) {
    for (std::size_t r = c + 1; r < a.rows(); ++r) ASSERT_EQ(a(r, c), 0.0) << r << ", " << c;
  }
}

TEST(Kernels, ProductsAreSummedInOrderWhateverTheirShape) {
  test::for_all(300, [](test::Generator& g) {
    const std::size_t rows = any_size(g, 0, 11);
    const std::size_t inner = any_size(g, 0, 40);
    const std::size_t cols = any_size(g, 0, kMaxSize);
    static Storage a_storage;
    static Storage x_storage;
    static Storage out_storage;
    const MatrixView a = window(a_storage, rows, inner);
    const MatrixView x = window(x_storage, inner, cols);
    const MatrixView out = window(out_storage, rows, cols);
    store(test::any_matrix(g, rows, inner), a);
    store(test::any_matrix(g, inner, cols), x);
    const Dense before = test::any_matrix(g, rows, cols);
    store(before, out);
    const double scale = g.integer(0, 1) == 0 ? 1.0 : -1.0;
    scale > 0.0 ? add_product(a, x, out) : subtract_product(a, x, out);
    for (std::size_t r = 0; r < rows; ++r) {
      for (std::size_t c = 0; c < cols; ++c) {
        double sum = before(index(r), index(c));
        for (std::size_t k = 0; k < inner; ++k) sum += scale * a(r, k) * x(k, c);
        ASSERT_EQ(out(r, c), sum) << r << ", " << c;
      }
    }
  });
}

TEST(Kernels, RowsGiveTheSameDotProductsTogetherAsAlone) {
  test::for_all(300, [](test::Generator& g) {
    const std::size_t rows = any_size(g, 0, 20);
    const std::size_t n = any_size(g, 0, kMaxSize);
    static Storage storage;
    const MatrixView a = window(storage, rows, n);
    store(test::any_matrix(g, rows, n), a);
    const Dense b = test::any_matrix(g, n, 1);
    std::vector<double> together(rows);
    dot_rows(a, b.data(), together.data());
    for (std::size_t r = 0; r < rows; ++r) {
      ASSERT_EQ(together[r], dot(a.row(r), b.data(), n)) << r;
      EXPECT_NEAR(together[r], dense(a).row(index(r)).dot(b.col(0)), 1e-11);
    }
  });
}

TEST(Kernels, CholeskyRebuildsTheMatrix) {
  test::for_all(200, [](test::Generator& g) {
    const std::size_t n = any_size(g, 1, 60);
    const Dense a = test::any_covariance(g, n, 1e-3);
    static Storage storage;
    const MatrixView l = window(storage, n, n);
    Dense lower = a;
    lower.triangularView<Eigen::StrictlyUpper>().setConstant(kNaN);  // never read
    store(lower, l);
    ASSERT_EQ(cholesky_in_place(l), Status::kOk);
    Dense factor = dense(l);
    for (Eigen::Index r = 0; r < factor.rows(); ++r) {
      for (Eigen::Index c = r + 1; c < factor.cols(); ++c) EXPECT_TRUE(std::isnan(factor(r, c)));  // never written
      EXPECT_GT(factor(r, r), 0.0);
    }
    factor = Dense(factor.triangularView<Eigen::Lower>());
    EXPECT_LT(difference(factor * factor.transpose(), a), 1e-12);
  });
}

TEST(Kernels, CholeskyRefusesWhatIsNotPositiveDefinite) {
  test::for_all(300, [](test::Generator& g) {
    const std::size_t n = any_size(g, 1, 30);
    const Eigen::SelfAdjointEigenSolver<Dense> eigen(test::any_covariance(g, n));
    Eigen::VectorXd values = eigen.eigenvalues();
    values(g.integer(0, static_cast<std::int64_t>(n) - 1)) = -g.uniform(1e-6, 1.0);
    const Dense a = eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose();
    static Storage storage;
    const MatrixView l = window(storage, n, n);
    store(a, l);
    EXPECT_EQ(cholesky_in_place(l), Status::kNumericalFault);
    store(Dense::Zero(index(n), index(n)), l);
    EXPECT_EQ(cholesky_in_place(l), Status::kNumericalFault);
  });
}

TEST(Kernels, CholeskyRefusesWhatIsNotFinite) {
  test::for_all(300, [](test::Generator& g) {
    const std::size_t n = any_size(g, 1, 30);
    Dense a = test::any_covariance(g, n);
    const std::size_t r = any_size(g, 0, n - 1);
    const std::size_t c = any_size(g, 0, r);
    const double bad[] = {kNaN, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    a(index(r), index(c)) = bad[g.integer(0, 2)];
    static Storage storage;
    const MatrixView l = window(storage, n, n);
    store(a, l);
    EXPECT_EQ(cholesky_in_place(l), Status::kNumericalFault);
  });
}

TEST(Kernels, SolveLowerUndoesTheProduct) {
  test::for_all(200, [](test::Generator& g) {
    const std::size_t n = any_size(g, 1, 60);
    const std::size_t columns = any_size(g, 1, 60);
    const Dense factor = test::cholesky_factor(test::any_covariance(g, n));
    const Dense x = test::any_matrix(g, n, columns);
    static Storage l_storage;
    static Storage b_storage;
    const MatrixView l = window(l_storage, n, n);
    const MatrixView b = window(b_storage, n, columns);
    Dense lower = factor;
    lower.triangularView<Eigen::StrictlyUpper>().setConstant(kNaN);
    store(lower, l);
    store(factor * x, b);
    solve_lower_in_place(l, b);
    EXPECT_LT(difference(dense(b), x), 1e-10);

    Eigen::VectorXd v = factor.transpose() * x.col(0);
    solve_lower_transposed_in_place(l, v.data());
    EXPECT_LT(difference(v, x.col(0)), 1e-10);
  });
}

TEST(Kernels, SubtractGramIsTheProductAndSymmetricBitForBit) {
  test::for_all(300, [](test::Generator& g) {
    const std::size_t n = any_size(g, 1, kMaxSize);
    const std::size_t m = any_size(g, 0, 40);
    const Dense p = test::any_covariance(g, n);
    const Dense rows = test::any_matrix(g, m, n);
    static Storage p_storage;
    static Storage w_storage;
    const MatrixView out = window(p_storage, n, n);
    const MatrixView w = window(w_storage, m, n);
    store(p, out);
    store(rows, w);
    subtract_gram(out, w);
    EXPECT_LT(difference(dense(out), p - gram(rows)), 1e-12 * static_cast<double>(m + 1));
    test::expect_symmetric_bit_for_bit(out);
    EXPECT_TRUE(std::isnan(p_storage.view()(0, 0)));
    EXPECT_TRUE(std::isnan(p_storage.view()(n + 1, n + 1)));
  });
}

TEST(Kernels, MirrorLowerCopiesTheLowerTriangle) {
  test::for_all(20, [](test::Generator& g) {
    const std::size_t n = any_size(g, 1, 20);
    const Dense a = test::any_matrix(g, n, n);
    static Storage storage;
    const MatrixView p = window(storage, n, n);
    store(a, p);
    mirror_lower(p);
    const Dense expected = a.selfadjointView<Eigen::Lower>();
    EXPECT_EQ(dense(p), expected);
  });
}

/// Any shape, and with it the awkward ones: rows of zeros, columns of zeros, a rank below both sides.
Dense any_awkward_matrix(test::Generator& g, std::size_t rows, std::size_t cols) {
  Dense a = test::any_matrix(g, rows, cols);
  switch (g.integer(0, 4)) {
    case 0: a.row(index(any_size(g, 0, rows - 1))).setZero(); break;
    case 1: a.col(index(any_size(g, 0, cols - 1))).setZero(); break;
    case 2: {
      const std::size_t rank = any_size(g, 1, std::min(rows, cols));
      a = test::any_matrix(g, rows, rank) * test::any_matrix(g, rank, cols);
      break;
    }
    case 3: a.setZero(); break;
    default: break;
  }
  return a;
}

TEST(Kernels, TriangulariseKeepsTheGramMatrix) {
  test::for_all(500, [](test::Generator& g) {
    const std::size_t rows = any_size(g, 1, 40);
    const std::size_t cols = any_size(g, 1, 40);
    const std::size_t columns = any_size(g, 0, cols);
    const Dense a = any_awkward_matrix(g, rows, cols);
    static Storage storage;
    const MatrixView out = window(storage, rows, cols);
    store(a, out);
    triangularise(out, columns);
    expect_upper_triangular(out, std::min(columns, rows));
    EXPECT_LT(difference(gram(dense(out)), gram(a)), 1e-11 * (1.0 + gram(a).norm()));
  });
}

TEST(Kernels, FoldRowsAddsTheInformation) {
  test::for_all(500, [](test::Generator& g) {
    const std::size_t n = any_size(g, 1, 40);
    const std::size_t columns = any_size(g, 1, n);
    const std::size_t rows = any_size(g, 1, 20);
    Dense r = test::any_matrix(g, columns, n);
    r.leftCols(index(columns)).triangularView<Eigen::StrictlyLower>().setZero();
    if (g.integer(0, 3) == 0) r.setZero();
    const Dense b = any_awkward_matrix(g, rows, n);
    static Storage r_storage;
    static Storage b_storage;
    const MatrixView r_out = window(r_storage, columns, n);
    const MatrixView b_out = window(b_storage, rows, n);
    store(r, r_out);
    store(b, b_out);
    fold_rows(r_out, b_out, columns);
    expect_upper_triangular(r_out, columns);
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t c = 0; c < columns; ++c) ASSERT_EQ(b_out(i, c), 0.0);
    }
    const Dense before = gram(r) + gram(b);
    EXPECT_LT(difference(gram(dense(r_out)) + gram(dense(b_out)), before), 1e-11 * (1.0 + before.norm()));
  });
}

// The filter compresses track by track: what counts is the sum, not how it was handed over.
TEST(Kernels, FoldingInPartsIsFoldingAtOnce) {
  test::for_all(100, [](test::Generator& g) {
    const std::size_t n = any_size(g, 2, 30);
    const std::size_t rows = any_size(g, 2, 30);
    const Dense b = test::any_matrix(g, rows, n);
    const std::size_t first = any_size(g, 1, rows - 1);
    static Storage r_storage;
    static Storage b_storage;
    const MatrixView r = window(r_storage, n, n);
    store(Dense::Zero(index(n), index(n)), r);
    const MatrixView part = window(b_storage, rows, n);
    store(b, part);
    fold_rows(r, part.block(0, 0, first, n), n);
    fold_rows(r, part.block(first, 0, rows - first, n), n);
    EXPECT_LT(difference(gram(dense(r)), gram(b)), 1e-11 * gram(b).norm());
  });
}

}  // namespace
}  // namespace plumb
