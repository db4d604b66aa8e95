#include "tools/replay/outputs.h"

#include <cinttypes>
#include <cmath>

#include "tools/replay/report_fields.h"

namespace plumb::replay {
namespace {

// Seconds with all nine decimals, which a double does not hold for times since 1970.
void print_seconds(std::FILE* stream, Time t) {
  std::fprintf(stream, "%" PRId64 ".%09" PRId64, t.ns() / kNsPerSecond, t.ns() % kNsPerSecond);
}

void print_tum(std::FILE* stream, Time t, const std::array<double, 3>& p_WI_m, const std::array<double, 4>& q_WI) {
  print_seconds(stream, t);
  std::fprintf(stream, " %.9f %.9f %.9f %.12f %.12f %.12f %.12f\n", p_WI_m[0], p_WI_m[1], p_WI_m[2], q_WI[1], q_WI[2],
               q_WI[3], q_WI[0]);
}

void print_value(std::FILE* stream, double value) { std::fprintf(stream, ",%.17g", value); }
void print_value(std::FILE* stream, std::uint32_t value) { std::fprintf(stream, ",%" PRIu32, value); }

constexpr const char* kErrorNames[kNavErrorSize] = {"px", "py",  "pz",  "vx",  "vy",  "vz",  "ax", "ay",
                                                    "az", "bgx", "bgy", "bgz", "bax", "bay", "baz"};

}  // namespace

TimingRecord timing_record(const ImageRecord& record) {
  TimingRecord timing{.t_image = record.nav.t_image, .sequence = record.nav.sequence, .step_ns = record.step.cpu_ns};
  for (std::size_t i = 0; i < kStageCount; ++i) timing.stage_ns[i] = record.meter.cost(static_cast<Stage>(i)).cpu_ns;
  return timing;
}

Outputs::Outputs(const std::filesystem::path& folder, std::span<const std::filesystem::path> inputs)
    : trajectory_(folder / "trajectory.tum", inputs),
      trajectory_imu_(folder / "trajectory_imu.tum", inputs),
      states_(folder / "states.csv", inputs),
      covariance_(folder / "covariance.csv", inputs),
      timing_(folder / "timing.csv", inputs),
      features_(folder / "features.csv", inputs),
      summary_(folder / "summary.json", inputs) {
  write_headers();
}

void Outputs::write_headers() {
  std::FILE* states = states_.stream();
  std::fprintf(states,
               "t_ns,sequence,valid,mode,reset_count,p_WI_x_m,p_WI_y_m,p_WI_z_m,v_WI_x_m_s,v_WI_y_m_s,v_WI_z_m_s,"
               "q_WI_w,q_WI_x,q_WI_y,q_WI_z,b_gyro_x_rad_s,b_gyro_y_rad_s,b_gyro_z_rad_s,"
               "b_accel_x_m_s2,b_accel_y_m_s2,b_accel_z_m_s2");
  for (const char* name : kErrorNames) std::fprintf(states, ",sigma_%s", name);
  for_each_field(FrameReport{}, [states](const char* name, auto) { std::fprintf(states, ",%s", name); });
  std::fprintf(states, ",state_hash\n");

  std::fprintf(covariance_.stream(), "t_ns");
  for (std::size_t r = 0; r < kNavErrorSize; ++r) {
    for (std::size_t c = r; c < kNavErrorSize; ++c) {
      std::fprintf(covariance_.stream(), ",P_%s_%s", kErrorNames[r], kErrorNames[c]);
    }
  }
  std::fprintf(covariance_.stream(), "\n");

  std::fprintf(timing_.stream(), "t_ns,sequence");
  for (std::size_t i = 0; i < kStageCount; ++i) {
    std::fprintf(timing_.stream(), ",%s_us", to_string(static_cast<Stage>(i)));
  }
  std::fprintf(timing_.stream(), ",filter_us,step_us,front_end_heap_calls,filter_heap_calls,step_heap_calls\n");

  std::fprintf(features_.stream(), "t_ns,sequence,track_id,u_px,v_px,slam\n");
}

void Outputs::add_image(const ImageRecord& record) {
  for (const PendingFile* file : files_) file->check();  // a disk that is full now is not worth flying on for
  write_state_row(record);
  write_timing_row(record);
  write_feature_rows(record);
  if (!record.nav.state.valid) return;
  print_tum(trajectory_.stream(), record.nav.t_image, record.nav.state.p_WI_m, record.nav.state.q_WI);
  std::fprintf(covariance_.stream(), "%" PRId64, record.nav.t_image.ns());
  for (std::size_t r = 0; r < kNavErrorSize; ++r) {
    for (std::size_t c = r; c < kNavErrorSize; ++c) {
      print_value(covariance_.stream(), record.nav.state.covariance[r * kNavErrorSize + c]);
    }
  }
  std::fprintf(covariance_.stream(), "\n");
}

void Outputs::add_predicted(const PredictedState& state) {
  if (state.status.valid) print_tum(trajectory_imu_.stream(), state.t, state.p_WI_m, state.q_WI);
}

void Outputs::write_state_row(const ImageRecord& record) {
  std::FILE* stream = states_.stream();
  const NavState& state = record.nav.state;
  std::fprintf(stream, "%" PRId64 ",%" PRIu32 ",%d,%d,%" PRIu32, record.nav.t_image.ns(), record.nav.sequence,
               state.valid ? 1 : 0, static_cast<int>(record.nav.status.mode), state.reset_count);
  // An invalid state has no numbers: nan keeps anyone from plotting them.
  const auto print_all = [stream, &state](const auto& values) {
    for (const double value : values) print_value(stream, state.valid ? value : std::nan(""));
  };
  print_all(state.p_WI_m);
  print_all(state.v_WI_m_s);
  print_all(state.q_WI);
  print_all(state.b_gyro_rad_s);
  print_all(state.b_accel_m_s2);
  std::array<double, kNavErrorSize> sigma{};
  for (std::size_t i = 0; i < kNavErrorSize; ++i) sigma[i] = std::sqrt(state.covariance[i * (kNavErrorSize + 1)]);
  print_all(sigma);
  for_each_field(record.nav.report, [stream](const char*, auto value) { print_value(stream, value); });
  std::fprintf(stream, ",%016" PRIx64 "\n", record.nav.state_hash);
}

void Outputs::write_timing_row(const ImageRecord& record) {
  std::FILE* stream = timing_.stream();
  const auto print_us = [stream](std::int64_t ns) { std::fprintf(stream, ",%.3f", static_cast<double>(ns) * 1e-3); };
  std::fprintf(stream, "%" PRId64 ",%" PRIu32, record.nav.t_image.ns(), record.nav.sequence);
  for (std::size_t i = 0; i < kStageCount; ++i) print_us(record.meter.cost(static_cast<Stage>(i)).cpu_ns);
  print_us(record.meter.filter().cpu_ns);
  print_us(record.step.cpu_ns);
  std::fprintf(stream, ",%" PRIu64 ",%" PRIu64 ",%" PRIu64 "\n", record.meter.cost(Stage::kFrontEnd).heap_calls,
               record.meter.filter().heap_calls, record.step.heap_calls);
}

void Outputs::write_feature_rows(const ImageRecord& record) {
  for (const SeenFeature& seen : record.features) {
    std::fprintf(features_.stream(), "%" PRId64 ",%" PRIu32 ",%" PRIu32 ",%.2f,%.2f,%d\n", record.nav.t_image.ns(),
                 record.nav.sequence, seen.track_id, static_cast<double>(seen.u_px), static_cast<double>(seen.v_px),
                 seen.slam ? 1 : 0);
  }
}

void Outputs::set_summary(const std::string& json_text) {
  std::fwrite(json_text.data(), 1, json_text.size(), summary_.stream());
}

void Outputs::commit() {
  for (PendingFile* file : files_) file->close();
  summary_.remove_earlier();  // stopped from here on, the folder has no summary of other files
  for (PendingFile* file : files_) file->commit();
}

}  // namespace plumb::replay
