#include "test/support/dense.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace plumb::test {

Dense dense(ConstMatrixView view) {
  Dense out(index(view.rows()), index(view.cols()));
  for (std::size_t r = 0; r < view.rows(); ++r) {
    for (std::size_t c = 0; c < view.cols(); ++c) out(index(r), index(c)) = view(r, c);
  }
  return out;
}

void store(const Dense& from, MatrixView to) {
  for (std::size_t r = 0; r < to.rows(); ++r) {
    for (std::size_t c = 0; c < to.cols(); ++c) to(r, c) = from(index(r), index(c));
  }
}

Dense any_matrix(Generator& g, std::size_t rows, std::size_t cols, double sigma) {
  Dense out(index(rows), index(cols));
  for (Eigen::Index i = 0; i < out.size(); ++i) out.data()[i] = g.normal(sigma);
  return out;
}

Dense any_covariance(Generator& g, std::size_t n, double floor) {
  const Dense b = any_matrix(g, n, n);
  const Dense p = b * b.transpose() / static_cast<double>(n) + floor * Dense::Identity(index(n), index(n));
  return 0.5 * (p + p.transpose());
}

Dense inverse(const Dense& m) { return m.inverse(); }

Dense congruent(const Dense& a, const Dense& p) { return a * p * a.transpose(); }

Dense gram(const Dense& a) { return a.transpose() * a; }

Dense scaled(const Dense& p, const Eigen::VectorXd& by) {
  const Dense out = by.asDiagonal() * p * by.asDiagonal();
  return 0.5 * (out + out.transpose());
}

Dense cholesky_factor(const Dense& p) { return p.llt().matrixL(); }

double smallest_eigenvalue(const Dense& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Dense>(symmetric, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
}

void expect_symmetric_bit_for_bit(ConstMatrixView p) {
  for (std::size_t r = 0; r < p.rows(); ++r) {
    for (std::size_t c = 0; c < r; ++c) ASSERT_EQ(p(r, c), p(c, r)) << r << ", " << c;
  }
}

double difference(const Dense& a, const Dense& b) {
  EXPECT_EQ(a.rows(), b.rows());
  EXPECT_EQ(a.cols(), b.cols());
  return (a - b).cwiseAbs().maxCoeff();
}

}  // namespace plumb::test
