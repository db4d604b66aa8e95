#include "test/support/dense_filter.h"

namespace plumb::test {

DensePosterior dense_update(const Dense& p, const DenseRows& rows) {
  const Dense noise = rows.sigma.cwiseAbs2().asDiagonal();
  const Dense s = congruent(rows.h, p) + noise;
  const Dense k = p * rows.h.transpose() * inverse(s);
  const Dense keep = Dense::Identity(p.rows(), p.cols()) - k * rows.h;
  return {k * rows.r, congruent(keep, p) + congruent(k, noise)};
}

double covariance_difference(const Dense& a, const Dense& b) {
  const Eigen::VectorXd scale = a.diagonal().cwiseSqrt().cwiseInverse();
  return difference(scaled(a, scale), scaled(b, scale));
}

double false_information(const Dense& before, const Dense& after, const Dense& directions) {
  const Dense known = inverse(before) * directions;
  return (inverse(after) * directions - known).norm() / known.norm();
}

}  // namespace plumb::test
