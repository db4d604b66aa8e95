#include "fsw/app/parameters.h"

#include <gtest/gtest.h>

#include <string>
#include <type_traits>
#include <utility>

namespace plumb {
namespace {

// Converts to anything: with as many of these as the aggregate T has members it can be initialised, with more it
// cannot.
struct Anything {
  template <typename T>
  operator T() const;
};

template <typename T, std::size_t... I>
constexpr bool initialisable(std::index_sequence<I...>) {
  return requires { T{(static_cast<void>(I), Anything{})...}; };
}

template <typename T, std::size_t N = 0>
constexpr std::size_t members() {
  if constexpr (initialisable<T>(std::make_index_sequence<N + 1>{})) {
    return members<T, N + 1>();
  } else {
    return N;
  }
}

std::size_t rows_of(const std::string& group) {
  std::size_t count = 0;
  for (const ParamRow<Parameters>& row : parameter_table().rows()) count += row.name.starts_with(group + ".") ? 1 : 0;
  return count;
}

TEST(Parameters, EveryOptionHasARow) {
  EXPECT_EQ(rows_of("imu"), members<ImuOptions>());
  EXPECT_EQ(rows_of("vision"), members<VisionOptions>());
  EXPECT_EQ(rows_of("range"), members<RangeOptions>());
  EXPECT_EQ(rows_of("start"), members<StartOptions>());
  EXPECT_EQ(rows_of("tracker"), members<TrackerOptions>() - 1);  // the seed is no setting of the flight
  EXPECT_EQ(members<EstimatorOptions>(), 4U);
  EXPECT_EQ(members<Parameters>(), 2U);
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
