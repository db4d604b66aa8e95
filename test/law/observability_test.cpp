// The paper's theorem (section IV-B) on its own linearised system: at constant velocity, or constant acceleration, the
// camera leaves the scale of everything unobservable and one ranged facet makes it observable; position and heading
// stay unobservable with both; in hover the range reaches the facet only.

#include <gtest/gtest.h>

#include "test/law/linear_system.h"
#include "test/support/property.h"
#include "test/support/sim/scene.h"

namespace plumb::law {
namespace {

constexpr std::size_t kFeatures = 8;
constexpr double kPeriod_s = 0.25;
constexpr int kSteps = 24;
constexpr double kInNullSpace = 1e-9;     // residual of a direction that is not observable: rounding
constexpr double kOutOfNullSpace = 1e-3;  // residual of one that is

constexpr int kPosition = 3;
constexpr int kHeading = 1;
constexpr int kTilt = 2;  // joins the heading where nothing rotates: accelerometer bias can stand in for a tilt
constexpr int kScale = 1;

/// A nadir camera over features on uneven ground.
System system_over_ground(const Motion& motion, test::Generator& g) {
  System system;
  system.motion = motion;
  system.q_IC = sim::plain_rig().q_IC;
  system.u_C = Vec3(0.02, -0.015, 1.0).normalized();
  for (std::size_t j = 0; j < kFeatures; ++j) {
    const Vec3 below_m = motion(0.0).p_WI_m;
    system.features_m.emplace_back(below_m.x() + g.uniform(-4.0, 8.0), below_m.y() + g.uniform(-5.0, 5.0),
                                   g.uniform(-1.0, 1.0));
  }
  return system;
}

/// Level and without rotation.
Motion constant_acceleration(const Vec3& p_m, const Vec3& v_m_s, const Vec3& a_m_s2) {
  return [=](double t_s) {
    sim::TruthState truth;
    truth.p_WI_m = p_m + t_s * v_m_s + 0.5 * t_s * t_s * a_m_s2;
    truth.v_WI_m_s = v_m_s + t_s * a_m_s2;
    truth.a_WI_m_s2 = a_m_s2;
    return truth;
  };
}

/// A steady turn: the acceleration is constant in the body, though not in the world.
Motion circle(double radius_m, double rate_rad_s, double height_m) {
  return [=](double t_s) {
    const double angle = rate_rad_s * t_s;
    const Vec3 outward(std::cos(angle), std::sin(angle), 0.0);
    const Vec3 along(-std::sin(angle), std::cos(angle), 0.0);
    sim::TruthState truth;
    truth.p_WI_m = radius_m * outward + height_m * Vec3::UnitZ();
    truth.v_WI_m_s = radius_m * rate_rad_s * along;
    truth.a_WI_m_s2 = -radius_m * rate_rad_s * rate_rad_s * outward;
    truth.q_WI = Quat(Eigen::AngleAxisd(angle, Vec3::UnitZ()));
    truth.omega_I_rad_s = rate_rad_s * Vec3::UnitZ();
    return truth;
  };
}

/// Rotation and acceleration in all axes, changing all the time.
Motion lively() {
  const sim::Trajectory trajectory = sim::make_scene("excitation").trajectory;
  constexpr double kWhenItMoves_s = 25.0;
  return [=](double t_s) { return trajectory.at(kWhenItMoves_s + t_s); };
}

Motion random_cruise(test::Generator& g, double acceleration_m_s2) {
  return constant_acceleration({g.uniform(-5.0, 5.0), g.uniform(-5.0, 5.0), g.uniform(8.0, 15.0)},
                               {g.uniform(1.0, 2.0), g.uniform(-0.5, 0.5), g.uniform(-0.2, 0.2)},
                               g.normal_vector<3>(acceleration_m_s2));
}

/// Eq. scale-null-vector: [p, v, 0, 0, -a, F_1 ... F_N], a the acceleration in the body. The world's origin is where
/// the scaling starts from; any other differs by a translation, which is unobservable anyway.
Vector scale_direction(const System& system) {
  const sim::TruthState truth = system.motion(0.0);
  Vector n = Vector::Zero(system.size());
  n.segment<3>(kP) = truth.p_WI_m;
  n.segment<3>(kV) = truth.v_WI_m_s;
  n.segment<3>(kAccel) = -(truth.q_WI.conjugate() * truth.a_WI_m_s2);
  for (std::size_t j = 0; j < system.features_m.size(); ++j) n.segment<3>(feature_at(j)) = system.features_m[j];
  return n;
}

/// Eq. partial-scale-hover-null-vector: the depths of the features outside the facet, seen from the hovering camera.
Vector hover_direction(const System& system) {
  Vector n = Vector::Zero(system.size());
  for (std::size_t j = 3; j < system.features_m.size(); ++j) {
    n.segment<3>(feature_at(j)) = system.features_m[j] - system.motion(0.0).p_WI_m;
  }
  return n;
}

Vector translation_direction(const System& system, const Vec3& t_m) {
  Vector n = Vector::Zero(system.size());
  n.segment<3>(kP) = t_m;
  for (std::size_t j = 0; j < system.features_m.size(); ++j) n.segment<3>(feature_at(j)) = t_m;
  return n;
}

/// A turn of everything about the vertical through the origin.
Vector heading_direction(const System& system) {
  const sim::TruthState truth = system.motion(0.0);
  Vector n = Vector::Zero(system.size());
  n.segment<3>(kP) = Vec3::UnitZ().cross(truth.p_WI_m);
  n.segment<3>(kV) = Vec3::UnitZ().cross(truth.v_WI_m_s);
  n.segment<3>(kTheta) = truth.q_WI.conjugate() * Vec3::UnitZ();
  for (std::size_t j = 0; j < system.features_m.size(); ++j) {
    n.segment<3>(feature_at(j)) = Vec3::UnitZ().cross(system.features_m[j]);
  }
  return n;
}

Matrix matrix_of(const System& system, Sensors sensors) {
  return observability_matrix(system, sensors, 0.0, kPeriod_s, kSteps);
}

TEST(Observability, PositionAndHeadingAreNeverObservable) {
  test::for_all(3, [](test::Generator& g) {
    for (const Motion& motion : {lively(), random_cruise(g, 0.2), circle(4.0, 0.5, 10.0)}) {
      const System system = system_over_ground(motion, g);
      for (const Sensors sensors : {Sensors::kCamera, Sensors::kCameraAndRange}) {
        const Matrix m = matrix_of(system, sensors);
        EXPECT_LT(residual(m, heading_direction(system)), kInNullSpace);
        EXPECT_LT(residual(m, translation_direction(system, g.normal_vector<3>(1.0))), kInNullSpace);
      }
    }
  });
}

TEST(Observability, GenericMotionMakesScaleObservableWithoutRange) {
  test::for_all(3, [](test::Generator& g) {
    const System system = system_over_ground(lively(), g);
    for (const Sensors sensors : {Sensors::kCamera, Sensors::kCameraAndRange}) {
      const Matrix m = matrix_of(system, sensors);
      EXPECT_GT(residual(m, scale_direction(system)), kOutOfNullSpace);
      EXPECT_EQ(nullity(m), kPosition + kHeading);
    }
  });
}

TEST(Observability, AtConstantVelocityOnlyTheRangeSeesScale) {
  test::for_all(10, [](test::Generator& g) {
    const System system = system_over_ground(random_cruise(g, 0.0), g);
    const Matrix camera = matrix_of(system, Sensors::kCamera);
    EXPECT_LT(residual(camera, scale_direction(system)), kInNullSpace);
    EXPECT_EQ(nullity(camera), kPosition + kHeading + kTilt + kScale);
    const Matrix ranged = matrix_of(system, Sensors::kCameraAndRange);
    EXPECT_GT(residual(ranged, scale_direction(system)), kOutOfNullSpace);
    EXPECT_EQ(nullity(ranged), kPosition + kHeading + kTilt);
  });
}

TEST(Observability, AtConstantAccelerationOnlyTheRangeSeesScale) {
  test::for_all(10, [](test::Generator& g) {
    const System system = system_over_ground(random_cruise(g, 0.2), g);
    EXPECT_LT(residual(matrix_of(system, Sensors::kCamera), scale_direction(system)), kInNullSpace);
    EXPECT_GT(residual(matrix_of(system, Sensors::kCameraAndRange), scale_direction(system)), kOutOfNullSpace);
  });
}

TEST(Observability, InASteadyTurnOnlyTheRangeSeesScale) {
  test::for_all(3, [](test::Generator& g) {
    const System system = system_over_ground(circle(4.0, 0.5, 10.0), g);
    EXPECT_LT(residual(matrix_of(system, Sensors::kCamera), scale_direction(system)), kInNullSpace);
    EXPECT_GT(residual(matrix_of(system, Sensors::kCameraAndRange), scale_direction(system)), kOutOfNullSpace);
  });
}

TEST(Observability, EachRangeRowReadsTheRangeFromTheScaleDirection) {
  // Stretching the world by 1 + s stretches the range by 1 + s, whatever the facet: the row times N_s is the range.
  test::for_all(20, [](test::Generator& g) {
    const System system = system_over_ground(random_cruise(g, 0.0), g);
    const sim::TruthState truth = system.motion(0.0);
    const Vec3 n = (system.features_m[0] - system.features_m[1]).cross(system.features_m[2] - system.features_m[1]);
    const Vec3 u_W = truth.q_WI * (system.q_IC * system.u_C);
    const double range_m = (system.features_m[1] - truth.p_WI_m).dot(n) / u_W.dot(n);
    EXPECT_NEAR((range_row(system, 0.0) * scale_direction(system))(0), range_m, 1e-9 * std::abs(range_m));
  });
}

TEST(Observability, InHoverTheRangeReachesTheFacetOnly) {
  test::for_all(5, [](test::Generator& g) {
    const Vec3 place_m(1.0, 2.0, 10.0);
    const System hovering = system_over_ground(constant_acceleration(place_m, Vec3::Zero(), Vec3::Zero()), g);
    const Matrix camera = matrix_of(hovering, Sensors::kCamera);
    const Matrix ranged = matrix_of(hovering, Sensors::kCameraAndRange);
    EXPECT_LT(residual(ranged, hover_direction(hovering)), kInNullSpace);
    EXPECT_GT(residual(ranged, scale_direction(hovering) - translation_direction(hovering, place_m)), kOutOfNullSpace);
    // Without motion each depth is free; the range ties one combination of the facet's three.
    const int depths = static_cast<int>(kFeatures);
    EXPECT_EQ(nullity(camera), kPosition + kHeading + kTilt + depths);
    EXPECT_EQ(nullity(ranged), kPosition + kHeading + kTilt + depths - 1);

    const System moving = system_over_ground(constant_acceleration(place_m, {0.5, 0.0, 0.0}, Vec3::Zero()), g);
    EXPECT_GT(residual(matrix_of(moving, Sensors::kCameraAndRange), hover_direction(moving)), kOutOfNullSpace);
  });
}

TEST(Observability, ALeverArmAloneDoesNotHideTheScaleDirection) {
  // With the camera off the IMU's centre the scaling starts from the camera: the IMU moves by p + R p_IC, not p.
  // Without rotation the difference is a translation, so scale is as unobservable as before.
  test::for_all(5, [](test::Generator& g) {
    System system = system_over_ground(random_cruise(g, 0.1), g);
    system.p_IC_m = Vec3(0.3, -0.2, 0.1);
    Vector n = scale_direction(system);
    n.segment<3>(kP) += system.motion(0.0).q_WI * system.p_IC_m;
    EXPECT_LT(residual(matrix_of(system, Sensors::kCamera), n), kInNullSpace);
    EXPECT_GT(residual(matrix_of(system, Sensors::kCameraAndRange), n), kOutOfNullSpace);
  });
}

}  // namespace
}  // namespace plumb::law
