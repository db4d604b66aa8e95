#include "fsw/estimator/covariance.h"

#include <algorithm>

#include "fsw/math/kernels.h"
#include "fsw/measurement/nav_state.h"

namespace plumb {
namespace {

constexpr std::size_t kMaxAssignRows = 3;
constexpr std::size_t kMaxStates = 512;
constexpr std::size_t kMovingRows = 9;  // theta, xi_p, xi_v change with time; biases only gain noise

void mirror_block(MatrixView p, std::size_t at, std::size_t count) {
  for (std::size_t r = at; r < at + count; ++r) {
    for (std::size_t q = r + 1; q < at + count; ++q) p(r, q) = p(q, r);
    for (std::size_t c = 0; c < p.cols(); ++c) p(c, r) = p(r, c);
  }
}

}  // namespace

void clone_block(MatrixView p, std::size_t from, std::size_t to, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t c = 0; c < p.cols(); ++c) p(to + k, c) = p(from + k, c);
  }
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t r = 0; r < p.rows(); ++r) p(r, to + k) = p(r, from + k);
  }
}

void clear_block(MatrixView p, std::size_t at, std::size_t count) {
  for (std::size_t k = at; k < at + count; ++k) {
    for (std::size_t c = 0; c < p.cols(); ++c) {
      p(k, c) = 0.0;
      p(c, k) = 0.0;
    }
  }
}

void move_block(MatrixView p, std::size_t from, std::size_t to, std::size_t count) {
  clone_block(p, from, to, count);
  clear_block(p, from, count);
}

void multiply_rows(ConstMatrixView jacobian, const Support& support, ConstMatrixView p, MatrixView out) {
  for (std::size_t r = 0; r < jacobian.rows(); ++r) std::fill_n(out.row(r), out.cols(), 0.0);
  for (const Segment& s : support) {
    add_product(jacobian.block(0, s.start, jacobian.rows(), s.length), p.block(s.start, 0, s.length, p.cols()), out);
  }
}

void sum_products(ConstMatrixView a, const double* row, const Support& support, MatrixView out) {
  PLUMB_ASSERT(a.rows() == out.rows() && out.rows() <= kMaxProducts);
  double part[kMaxProducts];
  for (std::size_t r = 0; r < out.rows(); ++r) out(r, 0) = 0.0;
  for (const Segment& s : support) {
    dot_rows(a.block(0, s.start, a.rows(), s.length), row + s.start, part);
    for (std::size_t r = 0; r < out.rows(); ++r) out(r, 0) += part[r];
  }
}

void assign_linear(MatrixView p, std::size_t at, ConstMatrixView jacobian, const Support& support, const Mat3& noise) {
  const std::size_t rows = jacobian.rows();
  PLUMB_ASSERT(rows <= kMaxAssignRows && p.cols() <= kMaxStates);
  double buffer[kMaxAssignRows * kMaxStates];
  MatrixView jp(buffer, rows, p.cols(), kMaxStates);
  multiply_rows(jacobian, support, p, jp);
  for (std::size_t r = 0; r < rows; ++r) {
    double diagonal[kMaxAssignRows] = {};
    for (std::size_t q = 0; q < rows; ++q) {
      for (const Segment& s : support) {
        for (std::size_t k = s.start; k < s.start + s.length; ++k) diagonal[q] += jp(r, k) * jacobian(q, k);
      }
      diagonal[q] += noise(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(q));
    }
    for (std::size_t c = 0; c < p.cols(); ++c) p(at + r, c) = jp(r, c);
    for (std::size_t q = 0; q <= r; ++q) p(at + r, at + q) = p(at + q, at + r) = diagonal[q];
  }
  mirror_block(p, at, rows);
}

void add_linear(MatrixView p, std::size_t at, ConstMatrixView jacobian, std::size_t from) {
  const std::size_t rows = jacobian.rows();
  PLUMB_ASSERT(rows <= kMovingRows && (at + rows <= from || from + jacobian.cols() <= at));
  for (std::size_t r = 0; r < rows; ++r) {
    double* __restrict out = p.row(at + r);
    for (std::size_t k = 0; k < jacobian.cols(); ++k) {
      const double j = jacobian(r, k);
      const double* __restrict pk = p.row(from + k);
      for (std::size_t c = 0; c < p.cols(); ++c) out[c] += j * pk[c];
    }
  }
  // The square block still lacks the right-hand factor: its columns gain what p[.., from..] J^T adds.
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t q = 0; q <= r; ++q) {
      for (std::size_t k = 0; k < jacobian.cols(); ++k) p(at + r, at + q) += p(at + r, from + k) * jacobian(q, k);
    }
  }
  mirror_block(p, at, rows);
}

void propagate_core(MatrixView p, const Mat15& phi, const Mat15& q) {
  const std::size_t n = p.cols();
  PLUMB_ASSERT(n <= kMaxStates);
  double buffer[kMovingRows * kMaxStates];
  for (std::size_t r = 0; r < kMovingRows; ++r) {
    double* __restrict out = buffer + r * kMaxStates;
    for (std::size_t c = 0; c < n; ++c) out[c] = 0.0;
    for (std::size_t k = 0; k < kCoreSize; ++k) {
      const double f = phi(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(k));
      if (f == 0.0) continue;
      const double* __restrict pk = p.row(k);
      for (std::size_t c = 0; c < n; ++c) out[c] += f * pk[c];
    }
  }
  for (std::size_t r = 0; r < kMovingRows; ++r) {
    for (std::size_t c = 0; c < n; ++c) p(r, c) = buffer[r * kMaxStates + c];
  }
  auto core = p.fixed<15, 15>(0, 0);
  // The 15 x 15 block still lacks the right-hand Phi^T.
  const Mat15 block = core.lazyProduct(phi.transpose()) + q;
  core = 0.5 * (block + block.transpose());
  for (std::size_t r = 0; r < kMovingRows; ++r) {
    for (std::size_t c = kCoreSize; c < n; ++c) p(c, r) = p(r, c);
  }
}

void rotate_block(MatrixView p, std::size_t at, const Mat3& rotation) {
  for (std::size_t c = 0; c < p.cols(); ++c) {
    const Vec3 turned = rotation * Vec3(p(at, c), p(at + 1, c), p(at + 2, c));
    for (std::size_t k = 0; k < 3; ++k) p(at + k, c) = turned(static_cast<Eigen::Index>(k));
  }
  auto square = p.fixed<3, 3>(at, at);
  const Mat3 both = square * rotation.transpose();
  square = 0.5 * (both + both.transpose());
  mirror_block(p, at, 3);
}

Mat15 to_nav_covariance(ConstMatrixView p, const Quat& q_WI, const Vec3& p_WI, const Vec3& v_WI) {
  // dp = xi_p - [p]x theta, dv = xi_v - [v]x theta, dtheta_local = R^T theta.
  Mat15 t = Mat15::Zero();
  const auto at = [](std::size_t i) { return static_cast<Eigen::Index>(i); };
  t.block<3, 3>(at(kNavPosition), at(kXiP)).setIdentity();
  t.block<3, 3>(at(kNavPosition), at(kTheta)) = -skew(p_WI);
  t.block<3, 3>(at(kNavVelocity), at(kXiV)).setIdentity();
  t.block<3, 3>(at(kNavVelocity), at(kTheta)) = -skew(v_WI);
  t.block<3, 3>(at(kNavAttitude), at(kTheta)) = q_WI.toRotationMatrix().transpose();
  t.block<3, 3>(at(kNavGyroBias), at(kGyroBias)).setIdentity();
  t.block<3, 3>(at(kNavAccelBias), at(kAccelBias)).setIdentity();
  const Mat15 core = p.fixed<15, 15>(0, 0);
  const Mat15 tc = t.lazyProduct(core);
  return tc.lazyProduct(t.transpose());
}

}  // namespace plumb
