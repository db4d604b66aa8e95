#include "fsw/app/parameters.h"

#include <gtest/gtest.h>

#include <string>

#include "test/support/aggregate.h"

namespace plumb {
namespace {

using test::member_count;

std::size_t rows_of(const std::string& group) {
  std::size_t count = 0;
  for (const ParamRow<Parameters>& row : parameter_table().rows()) count += row.name.starts_with(group + ".") ? 1 : 0;
  return count;
}

TEST(Parameters, EveryOptionHasARow) {
  EXPECT_EQ(rows_of("imu"), member_count<ImuOptions>());
  EXPECT_EQ(rows_of("vision"), member_count<VisionOptions>());
  EXPECT_EQ(rows_of("range"), member_count<RangeOptions>());
  EXPECT_EQ(rows_of("direction"), member_count<DirectionOptions>());
  EXPECT_EQ(rows_of("start"), member_count<StartOptions>());
  EXPECT_EQ(rows_of("tracker"), member_count<TrackerOptions>() - 1);  // the seed is no setting of the flight
  EXPECT_EQ(rows_of("calibration"), member_count<CalibrationOptions>());
  EXPECT_EQ(rows_of("modes"), member_count<ModeOptions>());
  EXPECT_EQ(member_count<EstimatorOptions>(), 6U);
  EXPECT_EQ(member_count<Parameters>(), 3U);
}

TEST(Parameters, EveryRowReachesAMemberOfItsOwn) {
  const auto rows = parameter_table().rows();
  for (const ParamRow<Parameters>& row : rows) {
    SCOPED_TRACE(std::string(row.name));
    Parameters changed;
    EXPECT_EQ(row.get(changed), row.default_value);
    const double other = row.default_value == row.max ? row.min : row.max;
    ASSERT_EQ(parameter_table().set(changed, row.name, other).status, Status::kOk);
    for (const ParamRow<Parameters>& any : rows) {
      EXPECT_EQ(any.get(changed), any.name == row.name ? other : any.default_value) << any.name;
    }
  }
}

TEST(Parameters, EveryRowIsFitToPrint) {
  for (const ParamRow<Parameters>& row : parameter_table().rows()) {
    SCOPED_TRACE(std::string(row.name));
    EXPECT_LT(row.min, row.max);
    EXPECT_FALSE(row.unit.empty());
    EXPECT_FALSE(row.description.empty());
  }
}

std::string first_conflict(const Parameters& parameters) {
  const auto conflicts = conflicts_in(parameters);
  return conflicts.empty() ? "none" : conflicts[0];
}

TEST(Parameters, ValuesThatDoNotFitEachOtherAreNamed) {
  EXPECT_TRUE(conflicts_in(Parameters{}).empty());
  Parameters parameters;
  parameters.estimator.range.min_range_m = parameters.estimator.range.max_range_m;
  EXPECT_NE(first_conflict(parameters).find("range.min_range"), std::string::npos);
  parameters = {};
  parameters.estimator.vision.max_depth_m = 0.5 * parameters.estimator.vision.min_depth_m;
  EXPECT_NE(first_conflict(parameters).find("vision.min_depth"), std::string::npos);
  parameters = {};
  parameters.estimator.start.motion_window_s = 1.1 * parameters.estimator.start.motion_window_max_s;
  EXPECT_NE(first_conflict(parameters).find("start.motion_window"), std::string::npos);
  parameters.estimator.start.motion_window_s = parameters.estimator.start.motion_window_max_s;
  EXPECT_TRUE(conflicts_in(parameters).empty());
  parameters.modes.range_timeout_s = parameters.estimator.range.facet_after_s;
  EXPECT_NE(first_conflict(parameters).find("modes.range_timeout"), std::string::npos);
  parameters.estimator.range.facet = false;  // then no range waits for the facet
  EXPECT_TRUE(conflicts_in(parameters).empty());
}

TEST(Parameters, AllThatDoesNotFitIsNamedAtOnce) {
  Parameters parameters;
  parameters.estimator.range.min_range_m = parameters.estimator.range.max_range_m;
  parameters.estimator.vision.max_depth_m = 0.5 * parameters.estimator.vision.min_depth_m;
  parameters.estimator.vision.pixel_noise_min_px = 2.0 * parameters.estimator.vision.pixel_noise_max_px;
  parameters.estimator.start.motion_window_s = 1.1 * parameters.estimator.start.motion_window_max_s;
  parameters.tracker.window_px = 12;
  parameters.tracker.tile_columns = 64;
  parameters.tracker.fast_threshold_min = parameters.tracker.fast_threshold_max + 1;
  parameters.modes.range_timeout_s = parameters.estimator.range.facet_after_s;
  EXPECT_EQ(conflicts_in(parameters).size(), kMaxConflicts);
}

TEST(Parameters, TheRecordHoldsEveryParameterInForce) {
  Parameters parameters;
  parameters.estimator.range.gate_sigma = 4.5;
  const ParamsRecord record = params_record(parameters, "paper");
  EXPECT_STREQ(record.configuration.data(), "paper");
  const auto rows = parameter_table().rows();
  ASSERT_EQ(record.values.size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(record.values[i].name.data(), rows[i].name);
    EXPECT_EQ(record.values[i].value, rows[i].get(parameters));
  }
}

}  // namespace
}  // namespace plumb
