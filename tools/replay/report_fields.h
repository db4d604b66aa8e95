#pragma once
// The fields of the estimator's records under their names, in one place: tables, summary and telemetry tests visit
// them.

#include "fsw/estimator/report.h"

namespace plumb::replay {

/// Calls visit(name, value) for every field of a frame report; enums and flags as unsigned integers.
template <typename Visitor>
void for_each_field(const FrameReport& r, Visitor&& visit) {
  visit("tracks", r.tracks);
  visit("slam_features", r.slam_features);
  visit("slam_used", r.slam_used);
  visit("slam_rejected", r.slam_rejected);
  visit("slam_added", r.slam_added);
  visit("msckf_used", r.msckf_used);
  visit("msckf_rejected", r.msckf_rejected);
  visit("ranged_used", r.ranged_used);
  visit("ranged_rejected", r.ranged_rejected);
  visit("ranges_used", r.ranges_used);
  visit("range_outcome", static_cast<std::uint32_t>(r.range_outcome));
  visit("range_facet_0", r.range_facet[0]);
  visit("range_facet_1", r.range_facet[1]);
  visit("range_facet_2", r.range_facet[2]);
  visit("range_feature", r.range_feature);
  visit("range_measured_m", r.range_measured_m);
  visit("range_predicted_m", r.range_predicted_m);
  visit("range_sigma_m", r.range_sigma_m);
  visit("zero_velocity", static_cast<std::uint32_t>(r.zero_velocity));
  visit("directions_used", r.directions_used);
  visit("heading_known", static_cast<std::uint32_t>(r.heading_known));
}

/// Calls visit(name, value) for every counter.
template <typename Visitor>
void for_each_field(const EstimatorCounters& c, Visitor&& visit) {
  visit("imu_samples", c.imu_samples);
  visit("imu_out_of_order", c.imu_out_of_order);
  visit("imu_invalid", c.imu_invalid);
  visit("imu_gaps", c.imu_gaps);
  visit("imu_overflow", c.imu_overflow);
  visit("frames", c.frames);
  visit("frames_out_of_order", c.frames_out_of_order);
  visit("frames_without_imu", c.frames_without_imu);
  visit("ranges", c.ranges);
  visit("ranges_used", c.ranges_used);
  visit("ranges_feature", c.ranges_feature);
  visit("ranges_spare", c.ranges_spare);
  visit("ranges_gated", c.ranges_gated);
  visit("ranges_no_facet", c.ranges_no_facet);
  visit("ranges_bad_geometry", c.ranges_bad_geometry);
  visit("ranges_stale", c.ranges_stale);
  visit("ranges_invalid", c.ranges_invalid);
  visit("directions", c.directions);
  visit("directions_used", c.directions_used);
  visit("directions_gated", c.directions_gated);
  visit("directions_spare", c.directions_spare);
  visit("directions_invalid", c.directions_invalid);
  visit("numerical_faults", c.numerical_faults);
  visit("resets", c.resets);
}

}  // namespace plumb::replay
