// Each in-place operation on the covariance is J P J^T (+ Q) written out in full.

#include "fsw/estimator/covariance.h"

#include <gtest/gtest.h>

#include <limits>

#include "fsw/estimator/propagation.h"
#include "fsw/measurement/nav_state.h"
#include "test/support/estimator_cases.h"

namespace plumb {
namespace {

using test::Dense;
using test::dense;
using test::difference;
using test::index;

constexpr double kTolerance = 1e-12;
constexpr std::size_t kMaxSize = 64;
using Storage = MatrixStorage<kMaxSize + 2, kMaxSize + 2>;

struct Case {
  std::size_t n;
  Dense before;
  MatrixView p;
};

/// A random covariance in the middle of storage full of not-a-number.
Case any_case(test::Generator& g) {
  static Storage storage;
  test::store(Dense::Constant(kMaxSize + 2, kMaxSize + 2, std::numeric_limits<double>::quiet_NaN()), storage.view());
  const auto n = static_cast<std::size_t>(g.integer(20, kMaxSize));
  Case c{n, test::any_covariance(g, n), storage.view().block(1, 1, n, n)};
  test::store(c.before, c.p);
  return c;
}

void expect_is(const Case& c, const Dense& expected) {
  EXPECT_LT(difference(dense(c.p), expected), kTolerance);
  test::expect_symmetric_bit_for_bit(c.p);
}

struct Blocks {
  std::size_t from, to, count;
};
Blocks any_blocks(test::Generator& g, std::size_t n) {
  const auto count = static_cast<std::size_t>(g.integer(1, 6));
  const auto places = static_cast<std::int64_t>(n / count);
  const std::int64_t from = g.integer(0, places - 1);
  std::int64_t to = g.integer(0, places - 2);
  if (to >= from) ++to;
  return {static_cast<std::size_t>(from) * count, static_cast<std::size_t>(to) * count, count};
}

Dense copying(const Blocks& b, std::size_t n) {
  Dense j = Dense::Identity(index(n), index(n));
  for (std::size_t k = 0; k < b.count; ++k) {
    j.row(index(b.to + k)).setZero();
    j(index(b.to + k), index(b.from + k)) = 1.0;
  }
  return j;
}

TEST(Covariance, CloneBlockCopiesAnError) {
  test::for_all(300, [](test::Generator& g) {
    const Case c = any_case(g);
    const Blocks b = any_blocks(g, c.n);
    const Dense j = copying(b, c.n);
    clone_block(c.p, b.from, b.to, b.count);
    expect_is(c, test::congruent(j, c.before));
  });
}

TEST(Covariance, ClearBlockForgetsAnError) {
  test::for_all(300, [](test::Generator& g) {
    const Case c = any_case(g);
    const Blocks b = any_blocks(g, c.n);
    Dense j = Dense::Identity(index(c.n), index(c.n));
    for (std::size_t k = 0; k < b.count; ++k) j(index(b.from + k), index(b.from + k)) = 0.0;
    clear_block(c.p, b.from, b.count);
    expect_is(c, test::congruent(j, c.before));
  });
}

TEST(Covariance, MoveBlockCopiesThenForgets) {
  test::for_all(300, [](test::Generator& g) {
    const Case c = any_case(g);
    const Blocks b = any_blocks(g, c.n);
    Dense j = copying(b, c.n);
    for (std::size_t k = 0; k < b.count; ++k) j.row(index(b.from + k)).setZero();
    move_block(c.p, b.from, b.to, b.count);
    expect_is(c, test::congruent(j, c.before));
  });
}

struct SparseRows {
  Support support;
  Dense j;
};

/// Rows that are zero outside two segments, one of which may hold the assigned states themselves.
SparseRows any_rows(test::Generator& g, std::size_t rows, std::size_t n, std::size_t at) {
  SparseRows out;
  out.j = Dense::Zero(index(rows), index(n));
  const auto third = static_cast<std::size_t>(g.integer(1, static_cast<std::int64_t>(at)));
  const Segment segments[] = {{g.integer(0, 1) == 0 ? 0 : third / 2, third / 2}, {at, rows}, {at + rows, 4}};
  for (const Segment& s : segments) {
    if (s.length == 0 || (s.start == at && g.integer(0, 1) == 0)) continue;
    EXPECT_EQ(out.support.push_back(s), Status::kOk);
    out.j.middleCols(index(s.start), index(s.length)) = test::any_matrix(g, rows, s.length);
  }
  return out;
}

TEST(Covariance, AssignLinearIsTheFullProduct) {
  test::for_all(500, [](test::Generator& g) {
    const Case c = any_case(g);
    const auto rows = static_cast<std::size_t>(g.integer(1, 3));
    const auto at = static_cast<std::size_t>(g.integer(4, static_cast<std::int64_t>(c.n) - 8));
    const SparseRows sparse = any_rows(g, rows, c.n, at);
    const Mat3 noise = test::any_covariance(g, 3);
    static Storage storage;
    storage.clear();
    const MatrixView jacobian = storage.view(rows, c.n);
    test::store(sparse.j, jacobian);

    Dense j = Dense::Identity(index(c.n), index(c.n));
    j.middleRows(index(at), index(rows)) = sparse.j;
    Dense expected = test::congruent(j, c.before);
    expected.block(index(at), index(at), index(rows), index(rows)) += noise.topLeftCorner(index(rows), index(rows));
    assign_linear(c.p, at, jacobian, sparse.support, noise);
    expect_is(c, expected);
  });
}

TEST(Covariance, MultiplyRowsIsTheProduct) {
  test::for_all(200, [](test::Generator& g) {
    const Case c = any_case(g);
    const auto rows = static_cast<std::size_t>(g.integer(1, 3));
    const SparseRows sparse = any_rows(g, rows, c.n, 10);
    static Storage j_storage;
    static Storage out_storage;
    const MatrixView jacobian = j_storage.view(rows, c.n);
    test::store(sparse.j, jacobian);
    multiply_rows(jacobian, sparse.support, c.p, out_storage.view(rows, c.n));
    EXPECT_LT(difference(dense(out_storage.view(rows, c.n)), sparse.j * c.before), kTolerance);
  });
}

TEST(Covariance, PropagateCoreIsTheFullProduct) {
  test::for_all(300, [](test::Generator& g) {
    const Case c = any_case(g);
    Mat15 phi = Mat15::Identity();  // as propagation.h promises: the rows of the biases are identity
    phi.topRows<9>() = test::any_matrix(g, 9, 15);
    if (g.integer(0, 1) == 0) phi.block<9, 6>(0, 9).setZero();
    const Mat15 q = test::any_covariance(g, 15);
    Dense j = Dense::Identity(index(c.n), index(c.n));
    j.topLeftCorner<15, 15>() = phi;
    Dense expected = test::congruent(j, c.before);
    expected.topLeftCorner<15, 15>() += q;
    propagate_core(c.p, phi, q);
    expect_is(c, expected);
  });
}

/// Error of `truth` against `estimate` as nav_state.h defines it.
test::Vec15 nav_error(const CoreState& truth, const CoreState& estimate) {
  test::Vec15 e;
  e << truth.motion.p_WI_m - estimate.motion.p_WI_m, truth.motion.v_WI_m_s - estimate.motion.v_WI_m_s,
      so3_log(estimate.motion.q_WI.conjugate() * truth.motion.q_WI), truth.b_gyro_rad_s - estimate.b_gyro_rad_s,
      truth.b_accel_m_s2 - estimate.b_accel_m_s2;
  return e;
}

TEST(Covariance, TheNavCovarianceIsTheOneOfTheLocalError) {
  test::for_all(200, [](test::Generator& g) {
    const CoreState core = test::core_over_ground(g, static_cast<std::size_t>(g.integer(0, 1000)));
    const auto t = test::numeric_jacobian<15, 15>(
        [&](const test::Vec15& e) {
          CoreState truth = core;
          retract_core(truth, e.data());
          return nav_error(truth, core);
        },
        1e-6);
    const Case c = any_case(g);
    const Dense core_block = c.before.topLeftCorner<15, 15>();
    const Dense expected = test::congruent(t, core_block);
    const Mat15 nav = to_nav_covariance(c.p, core.motion.q_WI, core.motion.p_WI_m, core.motion.v_WI_m_s);
    EXPECT_LT(difference(nav, expected), 1e-6 * expected.norm());
  });
}

}  // namespace
}  // namespace plumb
