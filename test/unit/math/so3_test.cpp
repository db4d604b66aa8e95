#include "fsw/math/so3.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "test/support/property.h"

namespace plumb {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRounding = 1e-14;  // a few units in the last place of numbers of order one

/// Angles over every scale, from far below the series' limit to just under pi.
double any_angle(test::Generator& g) {
  return g.integer(0, 1) == 0 ? std::pow(10.0, g.uniform(-14.0, 0.0)) : g.uniform(0.0, kPi - 1e-6);
}

Vec3 any_rotation_vector(test::Generator& g) { return any_angle(g) * g.direction(); }

/// Rotation angle between two attitudes [rad], exact near zero.
double angle_between(const Quat& a, const Quat& b) { return so3_log(a.conjugate() * b).norm(); }

TEST(So3, SkewIsTheCrossProduct) {
  test::for_all(200, [](test::Generator& g) {
    const Vec3 a = g.normal_vector<3>(2.0);
    const Vec3 b = g.normal_vector<3>(2.0);
    EXPECT_LT((skew(a) * b - a.cross(b)).norm(), kRounding * 100.0);
    EXPECT_EQ(skew(a).transpose(), -skew(a));
  });
}

TEST(So3, ExpOfZeroIsTheIdentity) {
  EXPECT_EQ(so3_exp(Vec3::Zero()).coeffs(), Quat::Identity().coeffs());
  EXPECT_EQ(so3_log(Quat::Identity()), Vec3::Zero());
  EXPECT_EQ(so3_left_jacobian(Vec3::Zero()), Mat3::Identity());
}

TEST(So3, ExpTurnsByTheRightHand) {
  const Vec3 turned = so3_exp(Vec3(0.0, 0.0, 0.5 * kPi)) * Vec3::UnitX();
  EXPECT_LT((turned - Vec3::UnitY()).norm(), kRounding);
}

TEST(So3, LogUndoesExp) {
  test::for_all(5000, [](test::Generator& g) {
    const Vec3 r = any_rotation_vector(g);
    const Quat q = so3_exp(r);
    EXPECT_NEAR(q.norm(), 1.0, kRounding);
    EXPECT_LT((so3_log(q) - r).norm(), 1e-13 * std::max(r.norm(), 1e-3)) << r.transpose();
  });
}

TEST(So3, ExpUndoesLog) {
  test::for_all(2000, [](test::Generator& g) {
    const Quat q(g.normal_vector<4>(1.0).normalized());
    EXPECT_LE(so3_log(q).norm(), kPi + kRounding);
    EXPECT_LT(angle_between(so3_exp(so3_log(q)), q), 1e-13);
  });
}

TEST(So3, LogTakesTheShortWayForBothSigns) {
  test::for_all(500, [](test::Generator& g) {
    const Vec3 r = any_rotation_vector(g);
    const Quat q = so3_exp(r);
    const Quat minus_q(-q.w(), -q.x(), -q.y(), -q.z());
    EXPECT_EQ(so3_log(q), so3_log(minus_q));
  });
}

TEST(So3, ExpIsARotationForLargeAngles) {
  test::for_all(500, [](test::Generator& g) {
    const Vec3 axis = g.direction();
    const double angle = g.uniform(-50.0, 50.0);
    const Mat3 expected = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    EXPECT_LT((so3_exp(angle * axis).toRotationMatrix() - expected).norm(), 1e-13);
  });
}

// Both sides of the angle where series and closed form meet must give the same numbers.
TEST(So3, IsContinuousWhereTheSeriesBegins) {
  test::for_all(200, [](test::Generator& g) {
    const Vec3 axis = g.direction();
    for (const double joint : {1e-4, 2e-4}) {  // of exp, and of log, whose quaternion carries half the angle
      const Vec3 below = joint * (1.0 - 1e-12) * axis;
      const Vec3 above = joint * (1.0 + 1e-12) * axis;
      const Vec3 step = above - below;
      EXPECT_LT((so3_log(so3_exp(above)) - so3_log(so3_exp(below)) - step).norm(), 1e-18);
      EXPECT_LT((so3_exp(above).coeffs() - so3_exp(below).coeffs()).norm(), 1e-15);
      // The closed form cancels in 1 - cos(angle) here, and the rest of it is multiplied by the angle.
      EXPECT_LT((so3_left_jacobian(above) - so3_left_jacobian(below)).norm(), 1e-12);
    }
  });
}

TEST(So3, LeftJacobianIsTheDerivativeOfExp) {
  test::for_all(1000, [](test::Generator& g) {
    const Vec3 a = any_rotation_vector(g);
    const Mat3 jacobian = so3_left_jacobian(a);
    constexpr double kStep = 1e-5;  // rad: the central difference is then good to about 1e-10
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 d = kStep * Vec3::Unit(axis);
      const Quat forward = so3_exp(a + d) * so3_exp(a).conjugate();
      const Quat backward = so3_exp(a - d) * so3_exp(a).conjugate();
      const Vec3 numeric = (so3_log(forward) - so3_log(backward)) / (2.0 * kStep);
      EXPECT_LT((numeric - jacobian.col(axis)).norm(), 1e-9) << a.transpose();
    }
  });
}

TEST(So3, LeftJacobianKeepsTheRotationAxis) {
  test::for_all(500, [](test::Generator& g) {
    const Vec3 a = any_rotation_vector(g);
    EXPECT_LT((so3_left_jacobian(a) * a - a).norm(), 1e-14 * std::max(1.0, a.norm()));
    // J_l(-a) is the right Jacobian, and Exp(a) maps one to the other.
    EXPECT_LT((so3_exp(a).toRotationMatrix() * so3_left_jacobian(-a) - so3_left_jacobian(a)).norm(), 1e-11);
  });
}

TEST(So3, RotationBetweenTakesOneVectorToTheOther) {
  test::for_all(1000, [](test::Generator& g) {
    const Vec3 from = g.uniform(0.1, 20.0) * g.direction();
    const Vec3 to = g.uniform(0.1, 20.0) * g.direction();
    const Quat q = rotation_between(from, to);
    EXPECT_NEAR(q.norm(), 1.0, kRounding);
    EXPECT_LT((q * from.normalized() - to.normalized()).norm(), 1e-12);
    // The smallest such rotation turns about the common normal.
    EXPECT_NEAR(q.vec().dot(from.normalized()), 0.0, 1e-14);
  });
}

TEST(So3, RotationBetweenParallelAndOppositeVectors) {
  test::for_all(300, [](test::Generator& g) {
    const Vec3 v = g.direction();
    EXPECT_LT(angle_between(rotation_between(v, 3.0 * v), Quat::Identity()), 1e-7);
    EXPECT_LT((rotation_between(v, -2.0 * v) * v + v).norm(), 1e-12);
    const Vec3 nearly = (-v + 1e-9 * g.direction()).normalized();
    EXPECT_LT((rotation_between(v, nearly) * v - nearly).norm(), 1e-8);
  });
}

}  // namespace
}  // namespace plumb
