#include "tools/replay/asl_reader.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "config/calibration_reader.h"
#include "config/input_error.h"
#include "tools/replay/csv.h"
#include "tools/replay/frame_assembler.h"
#include "tools/replay/png_image.h"

namespace plumb::replay {
namespace {

namespace fs = std::filesystem;

std::vector<ImuSample> read_imu_samples(const fs::path& file) {
  std::vector<ImuSample> samples;
  CsvReader csv(file);
  while (csv.next()) {
    csv.expect_columns(7, 7, "time stamp, 3 angular rates, 3 accelerations");
    ImuSample sample;
    sample.t = csv.time();
    for (std::size_t i = 0; i < 3; ++i) {
      // Not-a-number passes: it is a fault of the sensor that the flight software has to count and survive.
      sample.gyro_rad_s[i] = csv.number(1 + i);
      sample.accel_m_s2[i] = csv.number(4 + i);
    }
    samples.push_back(sample);
  }
  if (samples.empty()) throw InputError(file.string() + ": holds no sample; expected at least one row");
  return samples;
}

std::vector<RangeSample> read_range_samples(const fs::path& file) {
  std::vector<RangeSample> samples;
  CsvReader csv(file);
  while (csv.next()) {
    csv.expect_columns(2, 2, "time stamp, range [m]");
    RangeSample sample;
    sample.t = csv.time();
    sample.range_m = csv.number(1);
    if (sample.range_m < 0.0) csv.fail("column 2: expected a range of at least 0 m");
    const bool echo = std::isfinite(sample.range_m) && sample.range_m > 0.0;
    sample.quality = echo ? RangeQuality::kValid : RangeQuality::kNoReturn;
    samples.push_back(sample);
  }
  if (samples.empty()) throw InputError(file.string() + ": holds no range; expected at least one row, or --no-range");
  return samples;
}

void read_directions(const fs::path& file, DirectionSource source, std::vector<DirectionSample>& samples) {
  CsvReader csv(file);
  while (csv.next()) {
    csv.expect_columns(7, 7, "time stamp, direction seen in the IMU's frame, the same in east, north, up");
    DirectionSample sample;
    sample.t = csv.time();
    sample.source = source;
    for (std::size_t i = 0; i < 3; ++i) {
      sample.seen_I[i] = csv.number(1 + i);
      sample.known_W[i] = csv.number(4 + i);
    }
    samples.push_back(sample);
  }
}

std::vector<NavState> read_truth(const fs::path& file) {
  std::vector<NavState> states;
  CsvReader csv(file);
  while (csv.next()) {
    csv.expect_columns(11, 17, "time stamp, position, attitude wxyz, velocity, biases if known");
    NavState state;
    state.valid = true;
    state.t = csv.time();
    const bool biases = csv.columns() == 17;
    for (std::size_t i = 0; i < 3; ++i) {
      state.p_WI_m[i] = csv.number(1 + i);
      state.v_WI_m_s[i] = csv.number(8 + i);
      state.b_gyro_rad_s[i] = biases ? csv.number(11 + i) : 0.0;
      state.b_accel_m_s2[i] = biases ? csv.number(14 + i) : 0.0;
    }
    for (std::size_t i = 0; i < 4; ++i) state.q_WI[i] = csv.number(4 + i);
    for (std::size_t i = 1; i < csv.columns(); ++i) {
      if (!std::isfinite(csv.number(i))) csv.fail("column " + std::to_string(i + 1) + ": expected a finite number");
    }
    const std::array<double, 4>& q = state.q_WI;
    const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    constexpr double kUnit = 1e-3;
    if (std::abs(norm - 1.0) > kUnit) csv.fail("columns 5 to 8: expected a unit quaternion w x y z");
    for (double& component : state.q_WI) component /= norm;
    states.push_back(state);
  }
  return states;
}

// Sensors that share no moment were stamped by different clocks, and nothing would come of flying them.
void expect_common_time(const fs::path& file, Time first, Time last, const std::vector<CameraReference>& images) {
  const Time first_image = images.front().t_exposure_mid;
  const Time last_image = images.back().t_exposure_mid;
  if (first <= last_image && first_image <= last) return;
  throw InputError(file.string() + ": from " + std::to_string(first.ns()) + " to " + std::to_string(last.ns()) +
                   " ns; expected stamps of the same clock as the images, which are from " +
                   std::to_string(first_image.ns()) + " to " + std::to_string(last_image.ns()) + " ns");
}

// Images before the first or after the last IMU sample are flown to no effect.
void warn_of_images_without_imu(const fs::path& file, const std::vector<ImuSample>& imu,
                                const std::vector<CameraReference>& images, std::vector<std::string>& warnings) {
  const auto count = std::count_if(images.begin(), images.end(), [&imu](const CameraReference& image) {
    return image.t_exposure_mid < imu.front().t || image.t_exposure_mid > imu.back().t;
  });
  if (count == 0) return;
  warnings.push_back(file.string() + ": is from " + std::to_string(imu.front().t.ns()) + " to " +
                     std::to_string(imu.back().t.ns()) + " ns; " + std::to_string(count) + " of " +
                     std::to_string(images.size()) + " images are outside and get no state");
}

class AslSource final : public Source {
 public:
  explicit AslSource(const AslOptions& options)
      : root_(fs::is_directory(options.folder / "mav0") ? options.folder / "mav0" : options.folder) {
    if (!fs::is_directory(root_))
      throw InputError(options.folder.string() + ": not a folder; expected an ASL recording");
    for (const char* needed : {"cam0", "imu0"}) {
      if (!fs::is_directory(root_ / needed)) {
        throw InputError((root_ / needed).string() + ": not found; expected an ASL recording with cam0 and imu0");
      }
    }
    session_.source = options.folder.string();
    for (const char* sensor : {"cam0", "imu0", "range0", "sun0", "magnetometer0", "state_groundtruth_estimate0"}) {
      for (const fs::path& part : {root_ / sensor, root_ / sensor / "data.csv", root_ / sensor / "sensor.yaml"}) {
        session_.inputs.push_back(part);  // the files too: they may be links to elsewhere
      }
    }
    read_camera(root_ / "cam0", root_ / "imu0", session_.calibration, session_.warnings);
    read_imu(root_ / "imu0", session_.parameters, session_.warnings);
    if (options.use_range && fs::exists(root_ / "range0")) {
      read_range_finder(root_ / "range0", session_.calibration, session_.parameters, session_.warnings);
      range_ = read_range_samples(root_ / "range0" / "data.csv");
    }
    read_known_directions();
    if (!options.use_range) session_.parameters.estimator.range.enabled = false;
    if (!options.parameters.empty()) {
      session_.inputs.push_back(options.parameters);
      read_parameters(options.parameters, session_.parameters);
    }
    imu_ = read_imu_samples(root_ / "imu0" / "data.csv");
    read_images(root_ / "cam0");
    expect_common_time(root_ / "imu0" / "data.csv", imu_.front().t, imu_.back().t, camera_);
    warn_of_images_without_imu(root_ / "imu0" / "data.csv", imu_, camera_, session_.warnings);
    if (!range_.empty()) expect_common_time(root_ / "range0" / "data.csv", range_.front().t, range_.back().t, camera_);
    const fs::path truth = root_ / "state_groundtruth_estimate0" / "data.csv";
    if (fs::exists(truth)) session_.truth = read_truth(truth);
    assembler_ = std::make_unique<FrameAssembler>(imu_, range_, directions_, camera_);
    session_.imu_samples = imu_.size();
    session_.ranges = range_.size();
  }

  const Session& session() const override { return session_; }

  bool next(Tick& tick) override {
    const Status status = assembler_->next(tick.input);
    if (status == Status::kNotReady) return false;
    if (!ok(status)) fail_crowded(tick.input.t);
    tick.image = {};
    if (tick.input.has_camera) tick.image = read_image(tick.input.camera.sequence);
    return true;
  }

 private:
  [[noreturn]] void fail_crowded(Time t_tick) const {
    struct Limit {
      const char* folder;
      std::size_t rows;
    };
    constexpr Limit kLimits[] = {{"imu0", kMaxImuPerFrame},
                                 {"range0", kMaxRangePerFrame},
                                 {"sun0 or magnetometer0", kMaxDirectionPerFrame},
                                 {"cam0", 1}};
    const Limit& limit = kLimits[static_cast<std::size_t>(assembler_->crowded())];
    throw InputError((root_ / limit.folder / "data.csv").string() + ": too many rows within the 4 ms before " +
                     std::to_string(t_tick.ns()) + " ns; expected at most " + std::to_string(limit.rows));
  }

  // Sun sensor and magnetometer, each where its folder is there; together in order of time, the sun first.
  void read_known_directions() {
    constexpr std::pair<const char*, DirectionSource> kSensors[] = {{"sun0", DirectionSource::kSun},
                                                                    {"magnetometer0", DirectionSource::kMagnetometer}};
    for (const auto& [folder, source] : kSensors) {
      if (!fs::exists(root_ / folder)) continue;
      read_direction_sensor(root_ / folder, source, session_.parameters, session_.warnings);
      read_directions(root_ / folder / "data.csv", source, directions_);
    }
    std::stable_sort(directions_.begin(), directions_.end(),
                     [](const DirectionSample& a, const DirectionSample& b) { return a.t < b.t; });
  }

  void read_images(const fs::path& cam0) {
    CsvReader csv(cam0 / "data.csv");
    while (csv.next()) {
      csv.expect_columns(2, 2, "time stamp, file name");
      camera_.push_back({.t_exposure_mid = csv.time(), .sequence = static_cast<std::uint32_t>(files_.size())});
      files_.push_back(cam0 / "data" / csv.text(1));
      if (!fs::is_regular_file(files_.back())) csv.fail("image " + files_.back().string() + " not found");
    }
    if (files_.empty()) throw InputError((cam0 / "data.csv").string() + ": holds no image; expected at least one row");
    session_.images = files_.size();
    session_.t_first_image = camera_.front().t_exposure_mid;
    session_.t_last_image = camera_.back().t_exposure_mid;
  }

  ImageView read_image(std::uint32_t sequence) {
    const fs::path& file = files_[sequence];
    const ImageView image = image_.read(file);
    const CameraCalibration& camera = session_.calibration.camera;
    if (image.width != camera.width || image.height != camera.height) {
      throw InputError(file.string() + ": is " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                       " px; expected the resolution of cam0/sensor.yaml, " + std::to_string(camera.width) + " x " +
                       std::to_string(camera.height));
    }
    return image;
  }

  fs::path root_;  ///< holds cam0, imu0 and what else there is
  Session session_;
  std::vector<ImuSample> imu_;
  std::vector<RangeSample> range_;
  std::vector<DirectionSample> directions_;
  std::vector<CameraReference> camera_;
  std::vector<fs::path> files_;
  std::unique_ptr<FrameAssembler> assembler_;
  PngImage image_;
};

}  // namespace

std::unique_ptr<Source> open_asl(const AslOptions& options) { return std::make_unique<AslSource>(options); }

}  // namespace plumb::replay
