#include "test/support/sim/flight.h"

#include <algorithm>

namespace plumb::sim {
namespace {

constexpr double kRangePhase_s = 0.0113;
constexpr double kSunPhase_s = 0.0057;
constexpr double kMagnetometerPhase_s = 0.0029;
constexpr double kImagePhase_s = 0.0171;

void add_events(double rate_hz, double phase_s, double length_s, Source source, std::vector<Event>& events) {
  if (rate_hz == 0.0) return;
  for (int k = 0;; ++k) {
    const double t_s = phase_s + k / rate_hz;
    if (t_s > length_s) return;
    events.push_back({t_s, source});
  }
}

}  // namespace

std::vector<Event> flight_events(const FlightSettings& settings, double length_s) {
  std::vector<Event> events;
  add_events(settings.imu_rate_hz, 0.0, length_s, Source::kImu, events);
  add_events(settings.range_rate_hz, kRangePhase_s, length_s, Source::kRange, events);
  add_events(settings.sun.rate_hz, kSunPhase_s, length_s, Source::kSun, events);
  add_events(settings.magnetometer.rate_hz, kMagnetometerPhase_s, length_s, Source::kMagnetometer, events);
  add_events(settings.image_rate_hz, kImagePhase_s, length_s, Source::kImage, events);
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.t_s < b.t_s; });
  return events;
}

Time flight_epoch() { return Time::from_seconds(1000.0); }

NavState true_nav_state(const TruthState& truth, const ImuModel& imu, Time t) {
  NavState state;
  state.t = t;
  state.valid = true;
  for (int axis = 0; axis < 3; ++axis) {
    state.p_WI_m[axis] = truth.p_WI_m[axis];
    state.v_WI_m_s[axis] = truth.v_WI_m_s[axis];
    state.b_gyro_rad_s[axis] = imu.gyro_bias_rad_s()[axis];
    state.b_accel_m_s2[axis] = imu.accel_bias_m_s2()[axis];
  }
  state.q_WI = {truth.q_WI.w(), truth.q_WI.x(), truth.q_WI.y(), truth.q_WI.z()};
  return state;
}

}  // namespace plumb::sim
