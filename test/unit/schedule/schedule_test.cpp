// Every refusal of a schedule, by the predicates that its static_asserts are made of.

#include "fsw/schedule/schedule.h"

#include <gtest/gtest.h>

#include <array>

namespace plumb {
namespace {

constexpr DataSet kSensors = 1;
constexpr DataSet kFrame = 2;
constexpr DataSet kState = 4;
constexpr DataSet kReport = 8;

constexpr Duration us(std::int64_t n) { return Duration::from_us(n); }

constexpr std::array<Job, 4> kSound{{
    {.name = "assemble", .budget = us(1500), .inputs = kSensors, .outputs = kFrame},
    {.name = "predict", .budget = us(1000), .inputs = kFrame | kState, .outputs = 16},
    {.name = "report", .period_ticks = 250, .offset_ticks = 7, .budget = us(1500), .inputs = 16, .outputs = kReport},
    {.name = "nav",
     .thread = Thread::kOwn,
     .period_ticks = 8,
     .budget = us(32000),
     .logical_ticks = 8,
     .inputs = kFrame,
     .outputs = kState},
}};
static_assert(check_schedule<kSound, kSensors>());

/// The sound table with one job changed.
template <class Change>
constexpr std::array<Job, 4> with(std::size_t row, Change change) {
  std::array<Job, 4> jobs = kSound;
  change(jobs[row]);
  return jobs;
}

static_assert(!names_are_unique(with(1, [](Job& job) { job.name = "assemble"; })));
static_assert(!names_are_unique(with(1, [](Job& job) { job.name = ""; })));
static_assert(!offsets_are_within_periods(with(2, [](Job& job) { job.offset_ticks = 250; })));
static_assert(!hyper_period_fits(with(2, [](Job& job) { job.period_ticks = 0; })));
static_assert(!hyper_period_fits(with(2, [](Job& job) { job.period_ticks = 251; })));
static_assert(!budgets_are_positive(with(0, [](Job& job) { job.budget = Duration(); })));
static_assert(!budgets_fit_the_tick(with(2, [](Job& job) { job.budget = us(1501); })));
static_assert(budgets_fit_the_tick(with(3, [](Job& job) { job.budget = us(99000); })), "not in the tick");
static_assert(!logical_times_hold(with(0, [](Job& job) { job.logical_ticks = 1; })));
static_assert(!logical_times_hold(with(3, [](Job& job) { job.logical_ticks = 0; })));
static_assert(!logical_times_hold(with(3, [](Job& job) { job.logical_ticks = 9; })));
static_assert(!logical_times_hold(with(3, [](Job& job) { job.budget = us(32001); })));
static_assert(!every_record_has_one_writer(with(1, [](Job& job) { job.outputs = kFrame; }), kSensors));
static_assert(!every_record_has_one_writer(with(1, [](Job& job) { job.outputs = kSensors; }), kSensors));
static_assert(!every_input_is_written(kSound, 0));
static_assert(!readers_follow_writers(with(0, [](Job& job) { job.inputs = 16; })));
static_assert(!readers_follow_writers(with(0, [](Job& job) { job.inputs = kFrame; })), "its own output");
static_assert(readers_follow_writers(kSound), "the state is of an earlier tick");

TEST(Schedule, BusiestTickIsTheOneInWhichJobsMeet) {
  EXPECT_EQ(busiest_tick(kSound), us(4000));
  EXPECT_EQ(busiest_tick(with(2, [](Job& job) { job.budget = us(1); })), us(2501));
  const std::array<Job, 2> apart{{{.name = "a", .period_ticks = 2, .budget = us(100)},
                                  {.name = "b", .period_ticks = 2, .offset_ticks = 1, .budget = us(300)}}};
  EXPECT_EQ(busiest_tick(apart), us(300));
}

TEST(Schedule, JobIsDueAtItsOffsetAndThenOncePerPeriod) {
  const Job job{.name = "a", .period_ticks = 5, .offset_ticks = 3, .budget = us(1)};
  int due = 0;
  for (std::uint64_t tick = 0; tick < 1000; ++tick) {
    if (!job.due_in(tick)) continue;
    ++due;
    EXPECT_EQ(tick % 5, 3U);
  }
  EXPECT_EQ(due, 200);
}

}  // namespace
}  // namespace plumb
