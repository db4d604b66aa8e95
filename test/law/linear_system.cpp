#include "test/law/linear_system.h"

#include <Eigen/QR>
#include <cmath>

namespace plumb::law {
namespace {

constexpr double kStep_s = 1e-3;
constexpr double kSingular = 1e-9;
// A column far below the others is unobservable by itself; scaling it up would turn its rounding into signal.
constexpr double kSmallColumn = 1e-3;

Matrix dynamics(const sim::TruthState& truth) {
  const Mat3 r_WI = truth.q_WI.toRotationMatrix();
  const Vec3 force_m_s2 = r_WI.transpose() * (truth.a_WI_m_s2 + kGravity_m_s2 * Vec3::UnitZ());
  Matrix a = Matrix::Zero(kCore, kCore);
  a.block<3, 3>(kP, kV).setIdentity();
  a.block<3, 3>(kV, kTheta) = -r_WI * skew(force_m_s2);
  a.block<3, 3>(kV, kAccel) = -r_WI;
  a.block<3, 3>(kTheta, kTheta) = -skew(truth.omega_I_rad_s);
  a.block<3, 3>(kTheta, kGyro) = -Mat3::Identity();
  return a;
}

}  // namespace

Matrix transition(const Motion& motion, double from_s, double to_s) {
  const int steps = static_cast<int>(std::ceil((to_s - from_s) / kStep_s));
  Matrix phi = Matrix::Identity(kCore, kCore);
  for (int i = 0; i < steps; ++i) {
    const double h = (to_s - from_s) / steps;
    const double t_s = from_s + i * h;
    const Matrix a0 = dynamics(motion(t_s));
    const Matrix a1 = dynamics(motion(t_s + 0.5 * h));
    const Matrix a2 = dynamics(motion(t_s + h));
    const Matrix k1 = a0 * phi;
    const Matrix k2 = a1 * (phi + 0.5 * h * k1);
    const Matrix k3 = a1 * (phi + 0.5 * h * k2);
    const Matrix k4 = a2 * (phi + h * k3);
    phi += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }
  return phi;
}

Matrix camera_rows(const System& system, double t_s) {
  const sim::TruthState truth = system.motion(t_s);
  const Mat3 r_WI = truth.q_WI.toRotationMatrix();
  const Mat3 r_IC = system.q_IC.toRotationMatrix();
  Matrix h = Matrix::Zero(2 * static_cast<Eigen::Index>(system.features_m.size()), system.size());
  for (std::size_t j = 0; j < system.features_m.size(); ++j) {
    const Vec3 in_I = r_WI.transpose() * (system.features_m[j] - truth.p_WI_m);
    const Vec3 c = r_IC.transpose() * (in_I - system.p_IC_m);
    Eigen::Matrix<double, 2, 3> projection;
    projection << 1.0, 0.0, -c.x() / c.z(), 0.0, 1.0, -c.y() / c.z();
    projection /= c.z();
    const Eigen::Matrix<double, 2, 3> by_point = projection * (r_WI * r_IC).transpose();
    const Eigen::Index row = 2 * static_cast<Eigen::Index>(j);
    h.block<2, 3>(row, kP) = -by_point;
    h.block<2, 3>(row, kTheta) = projection * r_IC.transpose() * skew(in_I);
    h.block<2, 3>(row, feature_at(j)) = by_point;
  }
  return h;
}

Matrix range_row(const System& system, double t_s) {
  const sim::TruthState truth = system.motion(t_s);
  const Mat3 r_WI = truth.q_WI.toRotationMatrix();
  const Vec3 u_I = system.q_IC * system.u_C;
  const Vec3 origin_m = truth.p_WI_m + r_WI * system.p_IC_m;
  const Vec3& f1 = system.features_m[0];
  const Vec3& f2 = system.features_m[1];
  const Vec3& f3 = system.features_m[2];
  const Vec3 n = (f1 - f2).cross(f3 - f2);
  const double b = (r_WI * u_I).dot(n);
  const double range_m = (f2 - origin_m).dot(n) / b;
  const Vec3 impact_m = origin_m + range_m * (r_WI * u_I);
  Matrix h = Matrix::Zero(1, system.size());
  h.block<1, 3>(0, kP) = -n.transpose();
  h.block<1, 3>(0, kTheta) = n.transpose() * r_WI * (skew(system.p_IC_m) + range_m * skew(u_I));
  h.block<1, 3>(0, feature_at(0)) = (f3 - f2).cross(f2 - impact_m).transpose();
  h.block<1, 3>(0, feature_at(1)) = (n + (f1 - f3).cross(f2 - impact_m)).transpose();
  h.block<1, 3>(0, feature_at(2)) = (f2 - f1).cross(f2 - impact_m).transpose();
  return h / b;
}

Matrix observability_matrix(const System& system, Sensors sensors, double start_s, double period_s, int steps) {
  const Eigen::Index rows_per_step =
      2 * static_cast<Eigen::Index>(system.features_m.size()) + (sensors == Sensors::kCameraAndRange ? 1 : 0);
  Matrix m = Matrix::Zero(rows_per_step * steps, system.size());
  Matrix phi = Matrix::Identity(system.size(), system.size());
  for (int k = 0; k < steps; ++k) {
    const double t_s = start_s + k * period_s;
    Matrix h(rows_per_step, system.size());
    h.topRows(2 * static_cast<Eigen::Index>(system.features_m.size())) = camera_rows(system, t_s);
    if (sensors == Sensors::kCameraAndRange) h.bottomRows<1>() = range_row(system, t_s);
    m.middleRows(k * rows_per_step, rows_per_step) = h * phi;
    phi.topLeftCorner(kCore, kCore) =
        transition(system.motion, t_s, t_s + period_s) * phi.topLeftCorner(kCore, kCore).eval();
  }
  return m;
}

double residual(const Matrix& m, const Vector& n) {
  const Vector norms = m.colwise().norm().transpose();
  const Vector floored = norms.cwiseMax(kSmallColumn * norms.maxCoeff());
  return (m * n).norm() / floored.cwiseProduct(n).norm();
}

int nullity(const Matrix& m) {
  const Vector norms = m.colwise().norm().transpose();
  const Vector scale = norms.cwiseMax(kSmallColumn * norms.maxCoeff());
  const Matrix scaled = m * scale.cwiseInverse().asDiagonal();
  Eigen::ColPivHouseholderQR<Matrix> factors(scaled);
  factors.setThreshold(kSingular);
  return static_cast<int>(factors.dimensionOfKernel());
}

}  // namespace plumb::law
