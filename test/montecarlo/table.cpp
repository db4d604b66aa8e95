#include "test/montecarlo/table.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <ostream>
#include <string>

namespace plumb::sim {
namespace {

constexpr double kConfidence = 0.95;

struct Metric {
  const char* name;
  const char* unit;
  const char* csv_name;
  double (*value)(const Accuracy&);
};

constexpr std::array<Metric, 16> kMetrics = {{
    {"first output", "s", "first_output_s", [](const Accuracy& a) { return a.first_output_s; }},
    {"coverage", "%", "coverage_percent", [](const Accuracy& a) { return a.coverage_percent; }},
    {"distance", "m", "distance_m", [](const Accuracy& a) { return a.distance_m; }},
    {"position RMSE", "m", "position_rmse_m", [](const Accuracy& a) { return a.position_rmse_m; }},
    {"position at the end", "m", "position_final_m", [](const Accuracy& a) { return a.position_final_m; }},
    {"worst axis", "% of dist.", "worst_axis_percent", [](const Accuracy& a) { return a.worst_axis_percent; }},
    {"velocity RMSE", "m/s", "velocity_rmse_m_s", [](const Accuracy& a) { return a.velocity_rmse_m_s; }},
    {"attitude RMSE", "deg", "attitude_rmse_deg", [](const Accuracy& a) { return a.attitude_rmse_deg; }},
    {"|yaw| at the end", "deg", "yaw_final_deg", [](const Accuracy& a) { return a.yaw_final_deg; }},
    {"|scale error|, cruise", "%", "cruise_scale_percent", [](const Accuracy& a) { return a.cruise_scale_percent; }},
    {"|scale error|, Sim3", "%", "sim3_scale_percent", [](const Accuracy& a) { return a.sim3_scale_percent; }},
    {"ranges used", "%", "range_used_percent", [](const Accuracy& a) { return a.range_used_percent; }},
    {"NIS of a feature", "ideal 2", "feature_nis", [](const Accuracy& a) { return a.feature_nis; }},
    {"NIS of a track, per row", "ideal 1", "track_nis", [](const Accuracy& a) { return a.track_nis; }},
    {"NIS of its range", "ideal 1", "ranged_nis", [](const Accuracy& a) { return a.ranged_nis; }},
    {"NIS on a facet", "ideal 1", "range_nis", [](const Accuracy& a) { return a.range_nis; }},
}};

template <typename... Args>
std::string format(const char* pattern, Args... args) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), pattern, args...);
  return text.data();
}

std::string cell(double value) { return std::isnan(value) ? format("%10s", "-") : format("%10.4g", value); }

void print_metrics(std::ostream& out, const SceneResult& result) {
  out << format("%-34s %21s   %21s\n", "", "range-VIO", "VIO");
  out << format("%-34s %10s %10s   %10s %10s\n", "", "mean", "worst", "mean", "worst");
  for (const Metric& metric : kMetrics) {
    out << format("  %-22s %-9s", metric.name, metric.unit);
    for (const std::vector<Run>* runs : {&result.range_vio, &result.vio}) {
      const Spread spread = spread_of(*runs, metric.value);
      out << cell(spread.mean) << ' ' << cell(spread.worst) << "   ";
    }
    out << '\n';
  }
  const auto count = [](const std::vector<Run>& runs) {
    return format("%d of %d", diverged_count(runs), static_cast<int>(runs.size()));
  };
  out << format("  %-32s%21s   %21s\n", "diverged", count(result.range_vio).c_str(), count(result.vio).c_str());
}

void print_nees(std::ostream& out, const char* name, const std::vector<Run>& runs) {
  if (runs.empty()) return;
  out << format("  NEES, %-10s  dof   95 %% bounds   ", name);
  for (const double share : kCheckpoints) out << format("%7.0f %%", 100.0 * share);
  out << "   time mean   (* outside)\n";
  for (const NeesPart& part : kNeesParts) {
    std::string cells;
    Interval bounds = nees_bounds(kConfidence, part.dof, static_cast<int>(runs.size()));
    for (std::size_t i = 0; i < kCheckpoints.size(); ++i) {
      const SignedMean mean = mean_of(runs, [&](const Accuracy& a) { return a.nees[i].*part.member; });
      cells += format("%8.2f%c", mean.value, bounds.contains(mean.value) ? ' ' : '*');
    }
    const SignedMean over_time = mean_of(runs, [&](const Accuracy& a) { return a.mean_nees.*part.member; });
    out << format("    %-13s %4d   %5.2f .. %5.2f ", part.dof == 9 ? "all nine" : part.name, part.dof, bounds.low,
                  bounds.high)
        << cells << format("%10.2f\n", over_time.value);
  }
}

void print_csv_run(std::ostream& out, const std::string& scene, const char* filter, const Run& run) {
  out << scene << ',' << filter << ',' << run.seed << ',' << run.accuracy.started << ',' << run.accuracy.diverged;
  for (const Metric& metric : kMetrics) out << format(",%.9g", metric.value(run.accuracy));
  for (const Nees& nees : run.accuracy.nees) {
    for (const NeesPart& part : kNeesParts) out << format(",%.9g", nees.*part.member);
  }
  out << format(",%.3f,%016llx\n", run.cpu_s, static_cast<unsigned long long>(run.final_hash));
}

}  // namespace

void print_table(std::ostream& out, const SceneResult& result) {
  const std::vector<Run>& any = result.range_vio.empty() ? result.vio : result.range_vio;
  double cpu_s = 0.0;
  for (const std::vector<Run>* runs : {&result.range_vio, &result.vio}) {
    for (const Run& run : *runs) cpu_s += run.cpu_s;
  }
  out << format("\n%s: %d seeds, %.0f s CPU\n", result.scene.c_str(), static_cast<int>(any.size()), cpu_s);
  print_metrics(out, result);
  print_nees(out, "range-VIO", result.range_vio);
  print_nees(out, "VIO", result.vio);
}

void print_csv_header(std::ostream& out) {
  out << "scene,filter,seed,started,diverged";
  for (const Metric& metric : kMetrics) out << ',' << metric.csv_name;
  for (const double share : kCheckpoints) {
    for (const NeesPart& part : kNeesParts) out << format(",nees_%s_%.0f", part.name, 100.0 * share);
  }
  out << ",cpu_s,state_hash\n";
}

void print_csv_rows(std::ostream& out, const SceneResult& result) {
  for (const Run& run : result.range_vio) print_csv_run(out, result.scene, "range-vio", run);
  for (const Run& run : result.vio) print_csv_run(out, result.scene, "vio", run);
}

}  // namespace plumb::sim
