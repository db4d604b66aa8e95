#include "tools/replay/summary.h"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>

#include "hal/linux/resident_memory.h"
#include "tools/replay/heap_counter.h"
#include "tools/replay/report_fields.h"

namespace plumb::replay {
namespace {

using Json = nlohmann::ordered_json;

struct Distribution {
  double mean = 0.0;
  double median = 0.0;
  double p95 = 0.0;
  double max = 0.0;
};

Distribution distribution_of(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto at = [&values](double fraction) {
    return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1) + 0.5)];
  };
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return {.mean = sum / static_cast<double>(values.size()), .median = at(0.5), .p95 = at(0.95), .max = values.back()};
}

Json to_json(const Distribution& d) { return {{"mean", d.mean}, {"median", d.median}, {"p95", d.p95}, {"max", d.max}}; }

double coverage(const Session& session, const FlightTotals& totals) {
  return session.images == 0 ? 0.0 : static_cast<double>(totals.images_valid) / static_cast<double>(session.images);
}

std::string hex(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016" PRIx64, value);
  return text;
}

Json parameters_json(const Parameters& parameters) {
  Json json;
  for (const ParamRow<Parameters>& row : parameter_table().rows()) {
    json[std::string(row.name)] = row.get(parameters);
  }
  return json;
}

Json counters_json(const FlightTotals& totals) {
  Json json;
  for_each_field(totals.estimator, [&json](const char* name, std::uint64_t value) { json["estimator"][name] = value; });
  json["system"] = {{"ticks", totals.system.ticks},
                    {"ticks_out_of_order", totals.system.ticks_out_of_order},
                    {"samples_ahead", totals.system.samples_ahead},
                    {"frames", totals.system.frames},
                    {"frames_skipped", totals.system.frames_skipped},
                    {"frames_refused", totals.system.frames_refused}};
  json["predictor"] = {{"corrections", totals.predictor.corrections},
                       {"stale_corrections", totals.predictor.stale_corrections},
                       {"refused_samples", totals.predictor.refused_samples},
                       {"gaps", totals.predictor.gaps}};
  return json;
}

struct CalibrationEntry {
  const char* name;
  const char* unit;
};
constexpr std::array<CalibrationEntry, CalibrationReport::kSize> kCalibrationEntries{{
    {"gyro scale x", "1"},
    {"gyro scale y", "1"},
    {"gyro scale z", "1"},
    {"accel scale x", "1"},
    {"accel scale y", "1"},
    {"accel scale z", "1"},
    {"time offset", "s"},
    {"camera rotation x", "rad"},
    {"camera rotation y", "rad"},
    {"camera rotation z", "rad"},
    {"camera position x", "m"},
    {"camera position y", "m"},
    {"camera position z", "m"},
    {"beam tilt x", "rad"},
    {"beam tilt y", "rad"},
    {"beam origin x", "m"},
    {"beam origin y", "m"},
    {"beam origin z", "m"},
}};

/// What was estimated, as differences from the calibration file.
Json calibration_json(const CalibrationReport& calibration) {
  Json json = Json::array();
  for (std::size_t i = 0; i < CalibrationReport::kSize; ++i) {
    if (calibration.sigma[i] == 0.0) continue;
    json.push_back({{"name", kCalibrationEntries[i].name},
                    {"unit", kCalibrationEntries[i].unit},
                    {"value", calibration.value[i]},
                    {"sigma", calibration.sigma[i]}});
  }
  return json;
}

void print_calibration(const CalibrationReport& calibration) {
  for (std::size_t i = 0; i < CalibrationReport::kSize; ++i) {
    if (calibration.sigma[i] == 0.0) continue;
    std::printf("calibration     %-17s %+.6f, 1 sigma %.6f %s\n", kCalibrationEntries[i].name, calibration.value[i],
                calibration.sigma[i], kCalibrationEntries[i].unit);
  }
}

Json heap_json(const FlightTotals& totals) {
  if (!heap_calls_counted()) return nullptr;
  return {{"estimator", totals.filter_heap_calls},
          {"fsw_without_tracker", totals.fsw_heap_calls},
          {"tracker", totals.front_end_heap_calls}};
}

void print_ranges(const EstimatorCounters& c) {
  if (c.ranges == 0) {
    std::printf("ranges          none: flown with camera and IMU alone\n");
    return;
  }
  std::printf("ranges          %" PRIu64 ", on a facet %" PRIu64 ", by a feature %" PRIu64 ", spare %" PRIu64
              ", gated %" PRIu64 ", no facet %" PRIu64 ", geometry %" PRIu64 ", stale %" PRIu64 ", invalid %" PRIu64
              "\n",
              c.ranges, c.ranges_used, c.ranges_feature, c.ranges_spare, c.ranges_gated, c.ranges_no_facet,
              c.ranges_bad_geometry, c.ranges_stale, c.ranges_invalid);
}

}  // namespace

std::string summary_json(const Session& session, const FlightOptions& options, const FlightTotals& totals,
                         const HashCheck& hashes) {
  Json json;
  json["source"] = session.source;
  json["configuration"] = options.config_name;
  json["start_from_truth"] = options.start_from_truth;
  json["inputs"] = {{"images", session.images}, {"imu_samples", session.imu_samples}, {"ranges", session.ranges}};
  json["images_processed"] = totals.images_processed;
  json["images_valid"] = totals.images_valid;
  json["coverage"] = coverage(session, totals);
  json["image_span_s"] = (session.t_last_image - session.t_first_image).seconds();
  json["first_output_ns"] = totals.images_valid > 0 ? Json(totals.t_first_valid.ns()) : Json(nullptr);
  json["first_output_after_s"] =
      totals.images_valid > 0 ? Json((totals.t_first_valid - session.t_first_image).seconds()) : Json(nullptr);
  json["predicted_states"] = totals.predicted;
  json["run_hash"] = hex(totals.run_hash);
  if (hashes.recorded() > 0) {
    json["recorded_hashes"] = {{"recorded", hashes.recorded()}, {"different", hashes.different()}};
  }
  json["cpu_ms"] = {{"front_end", to_json(distribution_of(totals.front_end_ms))},
                    {"filter", to_json(distribution_of(totals.filter_ms))}};
  json["calibration"] = calibration_json(totals.calibration);
  json["pixel_noise_px"] = totals.pixel_noise_px;
  json["warnings"] = session.warnings;
  json["wall_s"] = totals.wall_s;
  json["peak_rss_mib"] = peak_resident_mib();
  json["heap_calls"] = heap_json(totals);
  json["counters"] = counters_json(totals);
  json["parameters"] = parameters_json(session.parameters);
  return json.dump(2) + "\n";
}

void print_summary(const Session& session, const FlightOptions& options, const FlightTotals& totals,
                   const HashCheck& hashes) {
  const EstimatorCounters& c = totals.estimator;
  std::printf("configuration   %s, run hash %s\n", options.config_name.c_str(), hex(totals.run_hash).c_str());
  if (hashes.first_different()) {
    std::printf("recorded hashes %" PRIu64 " of %" PRIu64 " differ, first at image %" PRIu32 "\n", hashes.different(),
                hashes.recorded(), *hashes.first_different());
  } else if (hashes.recorded() > 0) {
    std::printf("recorded hashes %" PRIu64 ", all equal\n", hashes.recorded());
  }
  std::printf("images          %zu, processed %" PRIu64 ", with a state %" PRIu64 " (%.1f %%)\n", session.images,
              totals.images_processed, totals.images_valid, 100.0 * coverage(session, totals));
  if (totals.images_valid > 0) {
    std::printf("first output    %.3f s after the first image\n",
                (totals.t_first_valid - session.t_first_image).seconds());
  }
  print_ranges(c);
  std::printf("resets          %" PRIu64 ", numerical faults %" PRIu64 ", IMU gaps %" PRIu64 "\n", c.resets,
              c.numerical_faults, c.imu_gaps);
  print_calibration(totals.calibration);
  std::printf("pixel noise     %.3f px at the end\n", totals.pixel_noise_px);
  std::printf("CPU per image    mean    median  95 %%    max      [ms]\n");
  const auto print_row = [](const char* name, const Distribution& d) {
    std::printf("  %-13s %7.3f %7.3f %7.3f %7.3f\n", name, d.mean, d.median, d.p95, d.max);
  };
  print_row("front end", distribution_of(totals.front_end_ms));
  print_row("filter", distribution_of(totals.filter_ms));
  if (heap_calls_counted()) {
    std::printf("heap calls      estimator %" PRIu64 ", fsw without tracker %" PRIu64 ", tracker %" PRIu64 "\n",
                totals.filter_heap_calls, totals.fsw_heap_calls, totals.front_end_heap_calls);
  }
  std::printf("wall time       %.2f s, peak memory %.1f MiB\n", totals.wall_s, peak_resident_mib());
}

}  // namespace plumb::replay
