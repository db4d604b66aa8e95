#pragma once
// The Kalman update written out with full matrices, and Jacobians of anything by moving the whole filter state.

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <vector>

#include "fsw/estimator/filter_state.h"
#include "test/support/estimator_cases.h"

namespace plumb::test {

/// r = H dx + n, n of these standard deviations.
struct DenseRows {
  Dense h;
  Eigen::VectorXd r;
  Eigen::VectorXd sigma;
};

struct DensePosterior {
  Eigen::VectorXd dx;
  Dense p;
};

/// Joseph form.
DensePosterior dense_update(const Dense& p, const DenseRows& rows);

/// d f(state) / d error, by central differences of the filter's own retraction; f gives `values` numbers.
template <class Config, typename F>
Dense numeric_state_jacobian(const FilterState<Config>& state, Eigen::Index values, F f, double step = 1e-6) {
  Dense jacobian(values, index(state.size()));
  for (std::size_t k = 0; k < state.size(); ++k) {
    std::vector<double> error(state.size(), 0.0);
    FilterState<Config> forward = state;
    FilterState<Config> backward = state;
    error[k] = step;
    forward.retract(error.data());
    error[k] = -step;
    backward.retract(error.data());
    jacobian.col(index(k)) = (f(forward) - f(backward)) / (2.0 * step);
  }
  return jacobian;
}

/// Every nominal number of the two states agrees to `tolerance`.
template <class Config>
void expect_same_nominal(const FilterState<Config>& a, const FilterState<Config>& b, double tolerance) {
  EXPECT_LT(so3_log(a.core.motion.q_WI.conjugate() * b.core.motion.q_WI).norm(), tolerance);
  EXPECT_LT((a.core.motion.p_WI_m - b.core.motion.p_WI_m).norm(), tolerance);
  EXPECT_LT((a.core.motion.v_WI_m_s - b.core.motion.v_WI_m_s).norm(), tolerance);
  EXPECT_LT((a.core.b_gyro_rad_s - b.core.b_gyro_rad_s).norm(), tolerance);
  EXPECT_LT((a.core.b_accel_m_s2 - b.core.b_accel_m_s2).norm(), tolerance);
  const CalibrationReport calibration = a.calibration_report();
  for (std::size_t i = 0; i < CalibrationReport::kSize; ++i)
    EXPECT_NEAR(calibration.value[i], b.calibration_report().value[i], tolerance) << i;
  ASSERT_EQ(a.window().size(), b.window().size());
  for (const std::size_t slot : a.window()) {
    EXPECT_LT(so3_log(a.pose(slot).q_WC.conjugate() * b.pose(slot).q_WC).norm(), tolerance) << slot;
    EXPECT_LT((a.pose(slot).camera.p_WC_m - b.pose(slot).camera.p_WC_m).norm(), tolerance) << slot;
  }
  ASSERT_EQ(a.features.size(), b.features.size());
  for (std::size_t i = 0; i < a.features.size(); ++i) {
    EXPECT_LT((a.features[i].parameters - b.features[i].parameters).norm(), tolerance) << i;
  }
}

/// Largest difference of two covariances, each element measured in standard deviations of `a`.
double covariance_difference(const Dense& a, const Dense& b);

/// What the update has learnt about the directions no sensor observes, relative to what the prior knew of them.
double false_information(const Dense& before, const Dense& after, const Dense& directions);

}  // namespace plumb::test
