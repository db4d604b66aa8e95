// The forms of the filter are one filter: on random operations, their covariances and corrections agree to rounding.

#include <gtest/gtest.h>

#include "test/budget/filter_forms/comparison.h"
#include "test/budget/filter_forms/root_form.h"
#include "test/support/dense.h"
#include "test/support/property.h"

namespace plumb::budget {
namespace {

using test::Generator;

/// A filter's life in random numbers: poses come and go, features are started, re-anchored, moved and removed.
class RandomFilter {
 public:
  explicit RandomFilter(Generator& g) : g_(g) {
    Operation<double>& start = add(Kind::kRestart);
    start.a = Table<double>::Zero(index(Layout::kFeatures), index(Layout::kFeatures));
    start.a.topLeftCorner(index(kCoreSize), index(kCoreSize)) = test::any_covariance(g_, kCoreSize);
    set_root(start, start.a);
    for (std::size_t image = 0; image < 6; ++image) run_image(image);
  }
  const std::vector<Operation<double>>& operations() const { return operations_; }

 private:
  static constexpr std::size_t kPoses = 3;  // slots in use

  Operation<double>& add(Kind kind) {
    operations_.emplace_back();
    operations_.back().kind = kind;
    operations_.back().size = Layout::feature(features_);
    return operations_.back();
  }
  Table<double> any(std::size_t rows, std::size_t cols) { return test::any_matrix(g_, rows, cols); }
  static Support columns(std::initializer_list<Segment> segments) {
    Support support;
    for (const Segment& s : segments) static_cast<void>(support.push_back(s));
    return support;
  }
  /// A row of random numbers where the support is.
  void fill(Table<double>& a, std::size_t row, const Support& support) {
    for (const Segment& s : support) a.block(index(row), index(s.start), 1, index(s.length)) = any(1, s.length);
  }

  void propagate() {
    Operation<double>& o = add(Kind::kPropagate);
    o.a = Table<double>::Identity(index(kCoreSize), index(kCoreSize));
    o.a.topRows(9) += 0.3 * any(9, kCoreSize);
    o.b = test::any_covariance(g_, kCoreSize);
  }

  void drop_pose(std::size_t slot) {
    const std::size_t heir = (slot + 1) % kPoses;
    for (std::size_t i = 0; i < features_; i += 2) {  // half of the features were anchored there
      assign(i, columns({{Layout::pose(slot), 6}, {Layout::pose(heir), 6}, {Layout::feature(i), 3}}), false);
    }
    Operation<double>& o = add(Kind::kClear);
    o.at = Layout::pose(slot);
    o.count = kPoseSize;
  }

  void clone(std::size_t slot) {
    Operation<double>& o = add(Kind::kClone);
    o.from = kTheta;
    o.at = Layout::pose(slot);
    o.count = kPoseSize;
  }

  void assign(std::size_t feature, const Support& support, bool noisy) {
    Operation<double>& o = add(Kind::kAssign);
    o.at = Layout::feature(feature);
    o.a = Table<double>::Zero(3, index(o.size));
    for (std::size_t r = 0; r < 3; ++r) fill(o.a, r, support);
    o.b = noisy ? Table<double>(test::any_covariance(g_, 3)) : Table<double>::Zero(3, 3);
    set_root(o, o.b);
    o.supports.assign(3, support);
  }

  void start_feature(bool correlated) {
    ++features_;
    Operation<double>& o = add(Kind::kClear);
    o.at = Layout::feature(features_ - 1);
    o.count = kFeatureSize;
    if (correlated) {
      assign(features_ - 1, columns({{Layout::kPoses, kPoseSize * FlightConfig::kMaxPoses}}), true);
    } else {
      Operation<double>& prior = add(Kind::kPrior);
      prior.at = Layout::feature(features_ - 1);
      prior.a = test::any_covariance(g_, 3);
    }
  }

  /// The last one takes its place; of the last one nothing is told but the new size.
  void remove_feature(std::size_t i) {
    if (i + 1 < features_) {
      Operation<double>& o = add(Kind::kMove);
      o.from = Layout::feature(features_ - 1);
      o.at = Layout::feature(i);
      o.count = kFeatureSize;
    }
    --features_;
  }

  void update() {
    Operation<double>& o = add(Kind::kUpdate);
    for (std::size_t i = 0; i < features_; ++i)
      o.supports.insert(
          o.supports.end(), 2,
          columns({{Layout::pose(i % kPoses), 6}, {Layout::pose((i + 1) % kPoses), 6}, {Layout::feature(i), 3}}));
    for (std::size_t k = 0; k < 4; ++k) o.supports.push_back(columns({{Layout::kPoses + k, 18 - k}}));
    o.a = Table<double>::Zero(index(o.supports.size()), index(o.size));
    for (std::size_t r = 0; r < o.supports.size(); ++r) {
      fill(o.a, r, o.supports[r]);
      o.residual.push_back(g_.normal(1.0));
    }
    o.groups = groups_of(o.supports);
  }

  void run_image(std::size_t image) {
    const std::size_t slot = image % kPoses;
    propagate();
    if (image % 2 == 1) propagate();
    if (image >= kPoses) drop_pose(slot);
    clone(slot);
    if (features_ > 2) remove_feature(1);
    if (image % 3 == 2) remove_feature(features_ - 1);
    update();
    start_feature(true);
    start_feature(false);
  }

  Generator& g_;
  std::size_t features_ = 0;
  std::vector<Operation<double>> operations_;
};

template <class Form>
void expect_agreement(const RandomFilter& filter, double tolerance) {
  const auto reference = std::make_unique<CovarianceForm<long double>>();
  const auto form = std::make_unique<Form>();
  for (const Operation<double>& operation : filter.operations()) {
    ASSERT_TRUE(reference->apply(operation.cast<long double>()));
    ASSERT_TRUE(form->apply(operation.template cast<typename Form::Number>()));
    const Table<long double> expected = reference->covariance();
    const Table<long double> found = form->covariance();
    ASSERT_EQ(found.rows(), expected.rows());
    const std::vector<long double> sigmas = sigmas_of(expected);
    for (Eigen::Index r = 0; r < expected.rows(); ++r) {
      for (Eigen::Index c = 0; c < expected.cols(); ++c) {
        const auto rounding = static_cast<double>(tolerance * sigmas[std::size_t(r)] * sigmas[std::size_t(c)]);
        ASSERT_NEAR(double(found(r, c)), double(expected(r, c)), rounding) << r << ", " << c;
      }
    }
    for (std::size_t i = 0; operation.kind == Kind::kUpdate && i < sigmas.size(); ++i)
      ASSERT_NEAR(double(form->correction()[i]), double(reference->correction()[i]), tolerance * double(sigmas[i]))
          << i;
  }
}

TEST(FilterForms, AreOneFilterToRounding) {
  test::for_all(1, [](Generator& g) {
    const RandomFilter filter(g);
    constexpr double kRounding = 1e-10;
    expect_agreement<FlownForm>(filter, kRounding);
    expect_agreement<CovarianceForm<double>>(filter, kRounding);
    expect_agreement<RootForm<double, RootUpdate::kHouseholder>>(filter, kRounding);
    expect_agreement<RootForm<double, RootUpdate::kCholesky>>(filter, kRounding);
    constexpr double kSingleRounding = 1e-2;
    expect_agreement<CovarianceForm<float>>(filter, kSingleRounding);
    expect_agreement<RootForm<float, RootUpdate::kHouseholder>>(filter, kSingleRounding);
    expect_agreement<RootForm<float, RootUpdate::kCholesky>>(filter, kSingleRounding);
  });
}

/// Of the first three states.
bool definite(const Table<long double>& p) { return definiteness_of(p.topLeftCorner(3, 3)).positive; }

TEST(FilterForms, OnlyTheSquareRootStaysDefiniteInSinglePrecision) {
  std::size_t indefinite = 0;
  test::for_all(10, [&indefinite](Generator& g) {
    const auto covariance = std::make_unique<CovarianceForm<float>>();
    const auto root = std::make_unique<RootForm<float, RootUpdate::kHouseholder>>();
    const auto apply = [&](const Operation<double>& operation) {
      static_cast<void>(covariance->apply(operation.cast<float>()));
      EXPECT_TRUE(root->apply(operation.cast<float>()));
    };
    Operation<double> start{.kind = Kind::kRestart, .size = Layout::kFeatures};
    start.a = Table<double>::Zero(index(Layout::kFeatures), index(Layout::kFeatures));
    start.a.topLeftCorner(3, 3).setIdentity();
    set_root(start, start.a);
    apply(start);
    for (std::size_t k = 0; k < 10; ++k) {
      constexpr double kPrecision = 1e5;  // squared, more than the digits of a float
      Operation<double> update{.kind = Kind::kUpdate, .size = Layout::kFeatures};
      update.a = Table<double>::Zero(1, index(Layout::kFeatures));
      update.a.leftCols(3) = kPrecision * g.direction().transpose();
      update.supports.resize(1);
      static_cast<void>(update.supports[0].push_back({0, 3}));
      update.groups = groups_of(update.supports);
      update.residual = {g.normal(1.0)};
      apply(update);
      EXPECT_TRUE(definite(root->covariance())) << k;
    }
    indefinite += definite(covariance->covariance()) ? 0 : 1;
  });
  EXPECT_GT(indefinite, 0U);  // else the root was asked nothing
}

}  // namespace
}  // namespace plumb::budget
