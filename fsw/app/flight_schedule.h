#pragma once
// The schedule of plumb-fsw. docs/executive.md has it as a table.

#include <array>

#include "fsw/schedule/schedule.h"

namespace plumb {

namespace flight_data {
inline constexpr DataSet kSamples = 1U << 0;       ///< what the device threads have stamped and parsed
inline constexpr DataSet kInputFrame = 1U << 1;    ///< logged before anybody reads it
inline constexpr DataSet kNavResult = 1U << 2;     ///< the estimate at an image
inline constexpr DataSet kOutput = 1U << 3;        ///< the estimate at each IMU sample
inline constexpr DataSet kTelemetry = 1U << 4;     ///< NAV_OUTPUT
inline constexpr DataSet kHealthReport = 1U << 5;  ///< NAV_HEALTH, SCHEDULE
}  // namespace flight_data

enum FlightJob : std::size_t { kJobAssemble = 0, kJobPredict, kJobPublish, kJobHealth, kJobNav };

inline constexpr std::array<Job, 5> kFlightSchedule{{
    {.name = "assemble",
     .budget = Duration::from_us(800),
     .inputs = flight_data::kSamples | flight_data::kNavResult,
     .outputs = flight_data::kInputFrame},
    {.name = "predict",
     .budget = Duration::from_us(1000),
     .inputs = flight_data::kInputFrame | flight_data::kNavResult,
     .outputs = flight_data::kOutput},
    {.name = "publish",
     .budget = Duration::from_us(1000),
     .inputs = flight_data::kOutput,
     .outputs = flight_data::kTelemetry},
    {.name = "health",
     .period_ticks = 250,
     .offset_ticks = 3,
     .budget = Duration::from_us(1000),
     .inputs = flight_data::kOutput | flight_data::kNavResult,
     .outputs = flight_data::kHealthReport},
    // Once per image, at most every 32 ms; an image that comes sooner waits for the release of the one before.
    {.name = "nav",
     .thread = Thread::kOwn,
     .period_ticks = 8,
     .budget = Duration::from_us(30'000),
     .logical_ticks = 8,
     .inputs = flight_data::kInputFrame,
     .outputs = flight_data::kNavResult},
}};
static_assert(check_schedule<kFlightSchedule, flight_data::kSamples>());

}  // namespace plumb
