#include "test/budget/filter_forms/comparison.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace plumb::budget {

Definiteness definiteness_of(const Table<long double>& p) {
  std::vector<Eigen::Index> used;
  for (Eigen::Index i = 0; i < p.rows(); ++i) {
    if (p(i, i) != 0.0L) used.push_back(i);
    if (!(p(i, i) >= 0.0L)) return {false, -std::numeric_limits<double>::infinity()};
  }
  Table<long double> correlation = p(used, used);
  const auto scale = correlation.diagonal().cwiseSqrt().cwiseInverse().eval();
  correlation = scale.asDiagonal() * correlation * scale.asDiagonal();
  const Eigen::LLT<Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>> factor(correlation);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(correlation.cast<double>(), Eigen::EigenvaluesOnly);
  return {factor.info() == Eigen::Success, eigen.eigenvalues()(0)};
}

ReferenceImage Reference::repeat(const std::vector<Operation<double>>& operations) {
  ReferenceImage image;
  for (const Operation<double>& operation : operations) {
    static_cast<void>(form_->apply(operation.cast<long double>()));
    if (operation.kind != Kind::kUpdate) continue;
    image.corrections.emplace_back(form_->correction().begin(), form_->correction().end());
    image.sigmas.push_back(sigmas_of(form_->covariance()));
  }
  image.last_sigmas = sigmas_of(form_->covariance());
  return image;
}

}  // namespace plumb::budget
