#pragma once
// The plain, dense linear algebra that the filter's in-place kernels are compared with.

#include <gtest/gtest.h>

#include <Eigen/Core>

#include "fsw/math/matrix.h"
#include "test/support/property.h"

namespace plumb::test {

using Dense = Eigen::MatrixXd;

inline Eigen::Index index(std::size_t i) { return static_cast<Eigen::Index>(i); }

inline Dense dense(ConstMatrixView view) {
  Dense out(index(view.rows()), index(view.cols()));
  for (std::size_t r = 0; r < view.rows(); ++r) {
    for (std::size_t c = 0; c < view.cols(); ++c) out(index(r), index(c)) = view(r, c);
  }
  return out;
}

inline void store(const Dense& from, MatrixView to) {
  for (std::size_t r = 0; r < to.rows(); ++r) {
    for (std::size_t c = 0; c < to.cols(); ++c) to(r, c) = from(index(r), index(c));
  }
}

inline Dense any_matrix(Generator& g, std::size_t rows, std::size_t cols, double sigma = 1.0) {
  Dense out(index(rows), index(cols));
  for (Eigen::Index i = 0; i < out.size(); ++i) out.data()[i] = g.normal(sigma);
  return out;
}

/// Symmetric bit for bit, positive definite, with correlations everywhere.
inline Dense any_covariance(Generator& g, std::size_t n, double floor = 0.1) {
  const Dense b = any_matrix(g, n, n);
  const Dense p = b * b.transpose() / static_cast<double>(n) + floor * Dense::Identity(index(n), index(n));
  return 0.5 * (p + p.transpose());
}

inline void expect_symmetric_bit_for_bit(ConstMatrixView p) {
  for (std::size_t r = 0; r < p.rows(); ++r) {
    for (std::size_t c = 0; c < r; ++c) ASSERT_EQ(p(r, c), p(c, r)) << r << ", " << c;
  }
}

/// Largest absolute difference of two matrices of the same shape.
inline double difference(const Dense& a, const Dense& b) {
  EXPECT_EQ(a.rows(), b.rows());
  EXPECT_EQ(a.cols(), b.cols());
  return (a - b).cwiseAbs().maxCoeff();
}

/// Central differences of f at zero error. f takes a vector of `In` errors and gives a vector of `Out` values.
template <int Out, int In, typename F>
Eigen::Matrix<double, Out, In> numeric_jacobian(F f, double step) {
  Eigen::Matrix<double, Out, In> jacobian;
  for (int k = 0; k < In; ++k) {
    const Eigen::Matrix<double, In, 1> e = step * Eigen::Matrix<double, In, 1>::Unit(k);
    jacobian.col(k) = (f(e) - f(-e)) / (2.0 * step);
  }
  return jacobian;
}

}  // namespace plumb::test
