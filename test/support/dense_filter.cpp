#include "test/support/dense_filter.h"

namespace plumb::test {

DensePosterior dense_update(const Dense& p, const DenseRows& rows) {
  const Dense noise = rows.sigma.cwiseAbs2().asDiagonal();
  const Dense s = rows.h * p * rows.h.transpose() + noise;
  const Dense k = p * rows.h.transpose() * inverse(s);
  const Dense keep = Dense::Identity(p.rows(), p.cols()) - k * rows.h;
  return {k * rows.r, keep * p * keep.transpose() + k * noise * k.transpose()};
}

double covariance_difference(const Dense& a, const Dense& b) {
  const Eigen::VectorXd scale = a.diagonal().cwiseSqrt().cwiseInverse();
  return difference(scale.asDiagonal() * a * scale.asDiagonal(), scale.asDiagonal() * b * scale.asDiagonal());
}

double false_information(const Dense& before, const Dense& after, const Dense& directions) {
  const Dense known = inverse(before) * directions;
  return (inverse(after) * directions - known).norm() / known.norm();
}

}  // namespace plumb::test
