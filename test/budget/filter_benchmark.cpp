// What the dense stages of the filter cost at the sizes that fly: by the kernels that fly, by Eigen's decompositions
// and products on matrices of variable size, and by plain loops.
//
//   build/flight/bin/plumb-bench [--benchmark_filter=Downdate]

#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <cmath>

#include "fsw/estimator/covariance.h"
#include "fsw/math/kernels.h"
#include "test/support/dense.h"
#include "test/support/property.h"

namespace plumb {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Layout = ErrorLayout<FlightConfig>;

constexpr Eigen::Index kStates = Layout::kSize;
constexpr Eigen::Index kPoseColumns = kPoseSize * FlightConfig::kMaxPoses + 1;  // with the residual
constexpr Eigen::Index kTrackRows = 2 * FlightConfig::kMaxPoses - 3;            // of one track, without its feature
constexpr Eigen::Index kUpdateRows = 2 * FlightConfig::kMaxSlamFeatures;        // of one image

MatrixView view(Matrix& m) {
  const auto cols = static_cast<std::size_t>(m.cols());
  return {m.data(), static_cast<std::size_t>(m.rows()), cols, cols};
}

struct Flown {
  static void propagate(Matrix& p, const Mat15& phi, const Mat15& q) { propagate_core(view(p), phi, q); }
  static void fold(Matrix& r, Matrix& rows) { fold_rows(view(r), view(rows), kPoseColumns - 1); }
  static void factorise(Matrix& s) { benchmark::DoNotOptimize(cholesky_in_place(view(s))); }
  static void solve(Matrix& l, Matrix& w) { solve_lower_in_place(view(l), view(w)); }
  static void downdate(Matrix& p, Matrix& w) { subtract_gram(view(p), view(w)); }
};

struct ByEigen {
  static void propagate(Matrix& p, const Mat15& phi, const Mat15& q) {
    const Eigen::Index rest = p.cols() - kCoreSize;
    p.topRightCorner(kCoreSize, rest) = phi * p.topRightCorner(kCoreSize, rest);
    p.bottomLeftCorner(rest, kCoreSize) = p.topRightCorner(kCoreSize, rest).transpose();
    p.topLeftCorner<kCoreSize, kCoreSize>() = phi * p.topLeftCorner<kCoreSize, kCoreSize>() * phi.transpose() + q;
  }
  static void fold(Matrix& r, Matrix& rows) {
    Matrix stacked(r.rows() + rows.rows(), r.cols());
    stacked << r, rows;
    const Eigen::HouseholderQR<Eigen::Ref<Matrix>> qr(stacked);
    r = qr.matrixQR().topRows(r.rows()).triangularView<Eigen::Upper>();
  }
  static void factorise(Matrix& s) {
    const Eigen::LLT<Eigen::Ref<Matrix>> llt(s);
    benchmark::DoNotOptimize(llt.info());
  }
  static void solve(Matrix& l, Matrix& w) { l.triangularView<Eigen::Lower>().solveInPlace(w); }
  static void downdate(Matrix& p, Matrix& w) {
    p.selfadjointView<Eigen::Lower>().rankUpdate(w.transpose(), -1.0);
    p.triangularView<Eigen::StrictlyUpper>() = p.transpose();
  }
};

/// As one would write it down. This file is compiled without vectors of the compiler's own making.
struct Plain {
  static void propagate(Matrix& p, const Mat15& phi, const Mat15& q) {
    constexpr Eigen::Index kCore = kCoreSize;
    Matrix product = Matrix::Zero(kCore, p.cols());
    for (Eigen::Index r = 0; r < kCore; ++r)
      for (Eigen::Index k = 0; k < kCore; ++k)
        for (Eigen::Index c = 0; c < p.cols(); ++c) product(r, c) += phi(r, k) * p(k, c);
    for (Eigen::Index r = 0; r < kCore; ++r)
      for (Eigen::Index c = kCore; c < p.cols(); ++c) p(r, c) = p(c, r) = product(r, c);
    for (Eigen::Index r = 0; r < kCore; ++r)
      for (Eigen::Index c = 0; c < kCore; ++c) {
        p(r, c) = q(r, c);
        for (Eigen::Index k = 0; k < kCore; ++k) p(r, c) += product(r, k) * phi(c, k);
      }
  }
  /// By Givens rotations.
  static void fold(Matrix& r, Matrix& rows) {
    for (Eigen::Index i = 0; i < rows.rows(); ++i)
      for (Eigen::Index k = 0; k + 1 < r.cols(); ++k) {
        const double length = std::sqrt(r(k, k) * r(k, k) + rows(i, k) * rows(i, k));
        if (!(length > 0.0)) continue;
        const double cosine = r(k, k) / length;
        const double sine = rows(i, k) / length;
        for (Eigen::Index c = k; c < r.cols(); ++c) {
          const double above = r(k, c);
          r(k, c) = cosine * above + sine * rows(i, c);
          rows(i, c) = cosine * rows(i, c) - sine * above;
        }
      }
  }
  static void factorise(Matrix& s) {
    for (Eigen::Index r = 0; r < s.rows(); ++r)
      for (Eigen::Index c = 0; c <= r; ++c) {
        double sum = s(r, c);
        for (Eigen::Index k = 0; k < c; ++k) sum -= s(r, k) * s(c, k);
        s(r, c) = r == c ? std::sqrt(sum) : sum / s(c, c);
      }
  }
  static void solve(Matrix& l, Matrix& w) {
    for (Eigen::Index r = 0; r < l.rows(); ++r) {
      for (Eigen::Index k = 0; k < r; ++k)
        for (Eigen::Index c = 0; c < w.cols(); ++c) w(r, c) -= l(r, k) * w(k, c);
      for (Eigen::Index c = 0; c < w.cols(); ++c) w(r, c) /= l(r, r);
    }
  }
  static void downdate(Matrix& p, Matrix& w) {
    for (Eigen::Index r = 0; r < p.rows(); ++r) {
      for (Eigen::Index k = 0; k < w.rows(); ++k)
        for (Eigen::Index c = 0; c <= r; ++c) p(r, c) -= w(k, r) * w(k, c);
      for (Eigen::Index c = 0; c < r; ++c) p(c, r) = p(r, c);
    }
  }
};

Matrix random(Eigen::Index rows, Eigen::Index cols) {
  test::Generator g(test::base_seed());
  return test::any_matrix(g, static_cast<std::size_t>(rows), static_cast<std::size_t>(cols));
}
Matrix random_covariance(Eigen::Index size) {
  test::Generator g(test::base_seed());
  return test::any_covariance(g, static_cast<std::size_t>(size));
}

/// Propagation of the covariance by one IMU sample.
template <class Kernels>
void Propagate(benchmark::State& state) {
  Matrix p = random_covariance(kStates);
  const Mat15 phi = Mat15::Identity() + 1e-6 * random(kCoreSize, kCoreSize);
  const Mat15 q = 1e-9 * Mat15::Identity();
  for (auto _ : state) {
    Kernels::propagate(p, phi, q);
    benchmark::DoNotOptimize(p.data());
  }
}

/// The rows of one track into the triangle of all.
template <class Kernels>
void Fold(benchmark::State& state) {
  Matrix r = random(kPoseColumns, kPoseColumns).triangularView<Eigen::Upper>();
  const Matrix rows = random(kTrackRows, kPoseColumns);
  Matrix work = rows;
  for (auto _ : state) {
    work = rows;
    Kernels::fold(r, work);
    benchmark::DoNotOptimize(r.data());
    r *= 0.5;  // so that nothing grows without end
  }
}

/// The covariance of the innovations of an image.
template <class Kernels>
void Factorise(benchmark::State& state) {
  const Matrix s = random_covariance(kUpdateRows);
  Matrix work = s;
  for (auto _ : state) {
    work = s;
    Kernels::factorise(work);
  }
}

/// L^-1 H P.
template <class Kernels>
void Solve(benchmark::State& state) {
  Matrix l = random_covariance(kUpdateRows).llt().matrixL();
  const Matrix hp = random(kUpdateRows, kStates);
  Matrix work = hp;
  for (auto _ : state) {
    work = hp;
    Kernels::solve(l, work);
    benchmark::DoNotOptimize(work.data());
  }
}

/// P - W^T W.
template <class Kernels>
void Downdate(benchmark::State& state) {
  Matrix p = random_covariance(kStates);
  Matrix w = 1e-9 * random(kUpdateRows, kStates);
  for (auto _ : state) {
    Kernels::downdate(p, w);
    benchmark::DoNotOptimize(p.data());
  }
}

#define PLUMB_BENCH_STAGE(stage)                                     \
  BENCHMARK_TEMPLATE(stage, Flown)->Unit(benchmark::kMicrosecond);   \
  BENCHMARK_TEMPLATE(stage, ByEigen)->Unit(benchmark::kMicrosecond); \
  BENCHMARK_TEMPLATE(stage, Plain)->Unit(benchmark::kMicrosecond)

PLUMB_BENCH_STAGE(Propagate);
PLUMB_BENCH_STAGE(Fold);
PLUMB_BENCH_STAGE(Factorise);
PLUMB_BENCH_STAGE(Solve);
PLUMB_BENCH_STAGE(Downdate);

}  // namespace
}  // namespace plumb
