#pragma once
// The plain, dense linear algebra that the filter's in-place kernels are compared with. Compiled once, in dense.cpp:
// Eigen's decompositions and products take a compiler many seconds.

#include <Eigen/Core>
#include <cstddef>

#include "fsw/math/matrix.h"
#include "test/support/property.h"

namespace plumb::test {

using Dense = Eigen::MatrixXd;

inline Eigen::Index index(std::size_t i) { return static_cast<Eigen::Index>(i); }

/// The view's numbers, as a matrix of its own.
Dense dense(ConstMatrixView view);
void store(const Dense& from, MatrixView to);

Dense any_matrix(Generator& g, std::size_t rows, std::size_t cols, double sigma = 1.0);
/// Symmetric bit for bit, positive definite, with correlations everywhere.
Dense any_covariance(Generator& g, std::size_t n, double floor = 0.1);

Dense inverse(const Dense& m);
/// A P A^T.
Dense congruent(const Dense& a, const Dense& p);
/// A^T A.
Dense gram(const Dense& a);
/// D P D with D = diag(by), symmetric bit for bit when P is.
Dense scaled(const Dense& p, const Eigen::VectorXd& by);
/// Lower Cholesky factor of a positive definite matrix.
Dense cholesky_factor(const Dense& p);
/// Of a symmetric matrix.
double smallest_eigenvalue(const Dense& symmetric);

void expect_symmetric_bit_for_bit(ConstMatrixView p);
/// Largest absolute difference of two matrices of the same shape.
double difference(const Dense& a, const Dense& b);

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
