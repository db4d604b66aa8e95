#pragma once
// How good a flight's estimate was, and whether its covariance said so.
//
// Position and heading have no absolute reference: the estimate starts them at zero with zero uncertainty. So the truth
// is moved into the estimate's world once, by the four degrees of freedom (translation, yaw) that make both agree at
// the first output. Nothing is fitted to the rest of the flight. Once the heading becomes known, the
// truth is moved anew, by translation alone: from there on the heading itself is judged.

#include <array>
#include <cstddef>
#include <span>

#include "test/support/sim/flight_log.h"

namespace plumb::sim {

/// NEES, e^T P^-1 e, is taken here: shares of the flight far enough apart for the errors to have decorrelated in part.
inline constexpr std::array<double, 4> kCheckpoints = {0.4, 0.6, 0.8, 1.0};

/// One estimate against the aligned truth: truth minus estimate, attitude local (R = R_hat Exp(e)).
struct NavError {
  Vec3 position_m = Vec3::Zero();
  Vec3 velocity_m_s = Vec3::Zero();
  Vec3 attitude_rad = Vec3::Zero();
};

/// Normalised squared errors; not-a-number where the covariance is not positive definite or there is no estimate.
struct Nees {
  double position = 0.0;  ///< 3 degrees of freedom each
  double velocity = 0.0;
  double attitude = 0.0;
  double joint = 0.0;  ///< 9 degrees of freedom
};

struct NeesPart {
  const char* name;
  int dof;
  double Nees::* member;
};
inline constexpr std::array<NeesPart, 4> kNeesParts = {{{"position", 3, &Nees::position},
                                                        {"velocity", 3, &Nees::velocity},
                                                        {"attitude", 3, &Nees::attitude},
                                                        {"joint", 9, &Nees::joint}}};
/// All but the joint one.
inline constexpr std::span<const NeesPart> kNeesOfVectors = std::span(kNeesParts).first(3);

struct Accuracy {
  bool started = false;   ///< there was an output at all; otherwise nothing below has a meaning
  bool diverged = false;  ///< never started, lost its state, reset itself, or left the bounds of diverged()
  double first_output_s = 0.0;
  double coverage_percent = 0.0;  ///< images with an output, of those from the first output on
  double distance_m = 0.0;        ///< flown after the first output
  double position_rmse_m = 0.0;
  double position_final_m = 0.0;
  double worst_axis_percent = 0.0;  ///< largest error on any axis at any time, of the distance
  double velocity_rmse_m_s = 0.0;
  double attitude_rmse_deg = 0.0;
  double yaw_final_deg = 0.0;
  double cruise_scale_percent =
      0.0;                          ///< estimated over true displacement along the cruise, minus 1; NaN without cruise
  double sim3_scale_percent = 0.0;  ///< Umeyama's scale of estimate over truth, minus 1
  std::array<Nees, kCheckpoints.size()> nees{};
  Nees mean_nees;                   ///< over all outputs from one second after the first
  double range_used_percent = 0.0;  ///< of all ranges
  double feature_nis = 0.0;  ///< normalised innovation squared of a feature in the state, mean; ideally 2. NaN: none
  double track_nis = 0.0;    ///< of a track beside the state, per row; ideally 1. NaN: none
  double ranged_nis = 0.0;   ///< what a range adds to that of its track; ideally 1. NaN: none
  double range_nis = 0.0;    ///< of a range that was compared with a facet; ideally 1. NaN: none
};

Accuracy evaluate(const FlightLog& log);

/// Errors of all points from the first output on, in the log's order; points without output are left out.
struct ErrorPoint {
  double t_s = 0.0;
  NavError error;
  Nees nees;
};
std::vector<ErrorPoint> errors_of(const FlightLog& log);

/// Quantile of the chi-square distribution by Wilson and Hilferty's cube root; better than 0.2 % from 10 dof on.
double chi_square_quantile(double probability, double dof);

/// The interval that the mean of `runs` independent NEES values of `dof` degrees of freedom each falls into with this
/// probability, when the covariance is right.
struct Interval {
  double low = 0.0;
  double high = 0.0;
  bool contains(double x) const { return x >= low && x <= high; }
};
Interval nees_bounds(double probability, int dof, int runs);

}  // namespace plumb::sim
