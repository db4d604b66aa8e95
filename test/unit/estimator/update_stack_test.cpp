#include "fsw/estimator/update_stack.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "test/support/dense_filter.h"

namespace plumb {
namespace {

using test::Dense;
using test::dense;
using test::DenseRows;
using test::index;
using test::TinyConfig;
using State = FilterState<TinyConfig>;
using Stack = UpdateStack<TinyConfig>;

std::unique_ptr<State> any_state(test::Generator& g) {
  auto state = std::make_unique<State>();
  test::fill_state(g, test::nadir_calibration(), static_cast<std::size_t>(g.integer(0, 6)), *state);
  return state;
}

/// Rows of unit noise that are zero outside a few segments. The innovations are of the size the prior leads to expect.
struct Rows {
  DenseRows dense;
  std::vector<Support> support;
};

Rows any_rows(test::Generator& g, const State& state, std::size_t count, double strength) {
  Rows out;
  const std::size_t n = state.size();
  out.dense.h = Dense::Zero(index(count), index(n));
  out.dense.r.resize(index(count));
  out.dense.sigma = Eigen::VectorXd::Ones(index(count));
  out.support.resize(count);
  const Eigen::VectorXd sigmas = test::prior_sigmas(state);
  for (std::size_t k = 0; k < count; ++k) {
    std::size_t start = static_cast<std::size_t>(g.integer(0, 8));
    for (int s = 0; s < 3 && start + 3 <= n; ++s) {
      const auto length = static_cast<std::size_t>(g.integer(1, 3));
      EXPECT_EQ(out.support[k].push_back({start, length}), Status::kOk);
      for (std::size_t c = start; c < start + length; ++c) {
        out.dense.h(index(k), index(c)) = strength * g.normal(1.0) / sigmas(index(c));
      }
      start += length + static_cast<std::size_t>(g.integer(0, static_cast<std::int64_t>(n / 3)));
    }
    out.dense.r(index(k)) = g.normal(1.0 + strength);
  }
  return out;
}

/// Adds rows first..last and returns the innovation test of the last call.
double add(const State& state, const Rows& rows, std::size_t row, Stack& stack, bool tested) {
  MatrixView h = stack.open(1);
  for (std::size_t c = 0; c < state.size(); ++c) h(0, c) = rows.dense.h(index(row), index(c));
  stack.residual(0) = rows.dense.r(index(row));
  if (tested) return stack.close(state, rows.support[row]);
  stack.close_untested(state, rows.support[row]);
  return 0.0;
}

void add_all(const State& state, const Rows& rows, Stack& stack) {
  for (std::size_t k = 0; k < rows.support.size(); ++k) add(state, rows, k, stack, k % 2 == 0);
}

std::unique_ptr<Stack> make_stack() { return std::make_unique<Stack>(); }

TEST(UpdateStack, IsTheKalmanUpdate) {
  const auto stack = make_stack();
  test::for_all(150, [&](test::Generator& g) {
    const auto state = any_state(g);
    const Rows rows = any_rows(g, *state, static_cast<std::size_t>(g.integer(1, Stack::kMaxRows)), 0.3);
    const test::DensePosterior expected = test::dense_update(dense(state->covariance()), rows.dense);
    State moved = *state;
    moved.retract(expected.dx.data());
    stack->begin(*state);
    add_all(*state, rows, *stack);
    ASSERT_EQ(stack->apply(*state), Status::kOk);
    for (std::size_t k = 0; k < state->size(); ++k) EXPECT_NEAR(stack->correction()[k], expected.dx(index(k)), 1e-9);
    test::expect_same_nominal(*state, moved, 1e-9);
    EXPECT_LT(test::covariance_difference(expected.p, dense(state->covariance())), 1e-9);
    test::expect_symmetric_bit_for_bit(state->covariance());
  });
}

TEST(UpdateStack, AWeakenedRowIsARowOfMoreNoise) {
  const auto stack = make_stack();
  test::for_all(50, [&](test::Generator& g) {
    const auto state = any_state(g);
    Rows rows = any_rows(g, *state, 4, 0.3);
    stack->begin(*state);
    for (std::size_t k = 0; k < 4; ++k) {
      add(*state, rows, k, *stack, k % 2 == 0);
      const double factor = g.uniform(1.0, 3.0);
      if (k < 2) continue;  // the first two as they are
      stack->weaken(1, factor);
      rows.dense.sigma(index(k)) = std::sqrt(factor);
    }
    const test::DensePosterior expected = test::dense_update(dense(state->covariance()), rows.dense);
    ASSERT_EQ(stack->apply(*state), Status::kOk);
    for (std::size_t k = 0; k < state->size(); ++k) EXPECT_NEAR(stack->correction()[k], expected.dx(index(k)), 1e-9);
    EXPECT_LT(test::covariance_difference(expected.p, dense(state->covariance())), 1e-9);
  });
}

TEST(UpdateStack, TheJointUpdateIsTheSequentialOneInAnyOrder) {
  const auto stack = make_stack();
  test::for_all(100, [&](test::Generator& g) {
    const auto joint = any_state(g);
    Rows rows = any_rows(g, *joint, static_cast<std::size_t>(g.integer(2, 20)), 0.3);
    State one_by_one = *joint;
    stack->begin(*joint);
    add_all(*joint, rows, *stack);
    ASSERT_EQ(stack->apply(*joint), Status::kOk);
    const Eigen::VectorXd together = Eigen::Map<const Eigen::VectorXd>(stack->correction(), index(joint->size()));

    std::vector<std::size_t> order(rows.support.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    for (std::size_t k = order.size(); k-- > 1;) {
      std::swap(order[k], order[static_cast<std::size_t>(g.integer(0, static_cast<std::int64_t>(k)))]);
    }
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(index(joint->size()));
    for (const std::size_t k : order) {
      Rows now = rows;
      now.dense.r(index(k)) -= rows.dense.h.row(index(k)) * sum;  // what the earlier rows have already explained
      stack->begin(one_by_one);
      add(one_by_one, now, k, *stack, false);
      ASSERT_EQ(stack->apply(one_by_one), Status::kOk);
      sum += Eigen::Map<const Eigen::VectorXd>(stack->correction(), index(joint->size()));
    }
    EXPECT_LT((sum - together).norm(), 1e-9 * (1.0 + together.norm()));
    EXPECT_LT(test::covariance_difference(dense(joint->covariance()), dense(one_by_one.covariance())), 1e-9);
  });
}

TEST(UpdateStack, TheInnovationTestIsAgainstThePrior) {
  const auto stack = make_stack();
  test::for_all(200, [&](test::Generator& g) {
    const auto state = any_state(g);
    const Rows rows = any_rows(g, *state, 3, 1.0);
    const Dense s = test::congruent(rows.dense.h, dense(state->covariance())) + Dense::Identity(3, 3);
    stack->begin(*state);
    MatrixView h = stack->open(3);
    test::store(rows.dense.h, h);
    for (std::size_t k = 0; k < 3; ++k) stack->residual(k) = rows.dense.r(index(k));
    Support all;
    ASSERT_EQ(all.push_back({0, state->size()}), Status::kOk);
    const double nis = stack->close(*state, all);
    EXPECT_NEAR(nis, rows.dense.r.dot(test::inverse(s) * rows.dense.r), 1e-9 * (1.0 + nis));
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(stack->innovation_variance(k), s(index(k), index(k)), 1e-9 * s.norm());
      EXPECT_GE(stack->innovation_variance(k), 1.0);
    }
    // Whitened rows: no eigenvalue of S below one, so its factor exists and is well conditioned in any arithmetic.
    EXPECT_GE(test::smallest_eigenvalue(s), 1.0 - 1e-9 * s.norm());
  });
}

TEST(UpdateStack, ATestOnAnUnsoundCovarianceIsNotPassed) {
  const auto stack = make_stack();
  test::for_all(50, [&](test::Generator& g) {
    const auto state = any_state(g);
    const Rows rows = any_rows(g, *state, 1, 1.0);
    const std::size_t c = rows.support[0][0].start;
    state->covariance()(c, c) = g.integer(0, 1) == 0 ? std::numeric_limits<double>::quiet_NaN() : -1e12;
    stack->begin(*state);
    EXPECT_FALSE(add(*state, rows, 0, *stack, true) <= 1e300);
    const State before = *state;
    EXPECT_EQ(stack->apply(*state), Status::kNumericalFault);
    test::expect_same_nominal(before, *state, 1e-300);
  });
}

TEST(UpdateStack, DiscardLeavesNoTrace) {
  const auto stack = make_stack();
  test::for_all(100, [&](test::Generator& g) {
    const auto state = any_state(g);
    State plain = *state;
    const Rows kept = any_rows(g, *state, 6, 0.3);
    const Rows rejected = any_rows(g, *state, 6, 3.0);
    stack->begin(plain);
    for (std::size_t k = 0; k < 6; ++k) add(plain, kept, k, *stack, true);
    ASSERT_EQ(stack->apply(plain), Status::kOk);
    const auto other = make_stack();
    other->begin(*state);
    for (std::size_t k = 0; k < 6; ++k) {
      add(*state, rejected, k, *other, true);
      other->discard(1);
      add(*state, kept, k, *other, true);
    }
    ASSERT_EQ(other->rows(), 6U);
    ASSERT_EQ(other->apply(*state), Status::kOk);
    EXPECT_EQ(state->hash(), plain.hash());  // the very same bits
  });
}

TEST(UpdateStack, NoRowsChangeNothing) {
  const auto stack = make_stack();
  test::for_all(20, [&](test::Generator& g) {
    const auto state = any_state(g);
    const std::uint64_t before = state->hash();
    stack->begin(*state);
    EXPECT_EQ(stack->apply(*state), Status::kOk);
    EXPECT_EQ(state->hash(), before);
    for (std::size_t k = 0; k < state->size(); ++k) EXPECT_EQ(stack->correction()[k], 0.0);
  });
}

// Thousands of updates, some of them ten thousand times as sharp as the prior, and none loses symmetry or definiteness,
// or makes a variance grow.
TEST(UpdateStack, TheCovarianceStaysSoundOverThousandsOfUpdates) {
  const auto stack = make_stack();
  test::for_all(10, [&](test::Generator& g) {
    const auto state = any_state(g);
    for (int round = 0; round < 300; ++round) {
      const Eigen::VectorXd before = dense(state->covariance()).diagonal();
      const double strength = std::pow(10.0, g.uniform(-3.0, 4.0));
      const Rows rows = any_rows(g, *state, static_cast<std::size_t>(g.integer(1, 12)), strength);
      stack->begin(*state);
      add_all(*state, rows, *stack);
      ASSERT_EQ(stack->apply(*state), Status::kOk);
      const Dense p = dense(state->covariance());
      test::expect_symmetric_bit_for_bit(state->covariance());
      ASSERT_GT(p.diagonal().minCoeff(), 0.0);
      ASSERT_LE((p.diagonal() - before).maxCoeff(), 1e-15 * before.maxCoeff());
      const Eigen::VectorXd scale = p.diagonal().cwiseSqrt().cwiseInverse();
      if (round % 20 == 0) {
        const Dense normalised = test::scaled(p, scale);
        ASSERT_GT(test::smallest_eigenvalue(normalised), 0.0) << round;
        // The features' and poses' numbers do not matter here; they must not run away over the rounds.
        test::store(p + 1e-6 * Dense(before.asDiagonal()), state->covariance());
      }
    }
  });
}

}  // namespace
}  // namespace plumb
