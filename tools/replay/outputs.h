#pragma once
// The files of a replay: trajectories, one row of states and of costs per image, the summary. Nothing carries its final
// name before commit().

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "fsw/telemetry/messages.h"
#include "tools/replay/pending_file.h"
#include "tools/replay/stage_meter.h"

namespace plumb::replay {

/// One feature seen in an image, for pictures.
struct SeenFeature {
  std::uint32_t track_id = 0;
  float u_px = 0.0F;  ///< column in the image as taken
  float v_px = 0.0F;  ///< row
  bool slam = false;  ///< in the state after the image
};

/// One processed image.
struct ImageRecord {
  NavStateRecord nav;
  std::vector<SeenFeature> features;
  StageMeter meter;
  StageCost step;  ///< of the whole step() call, front end included
};

/// The costs of an image as telemetry.
TimingRecord timing_record(const ImageRecord& record);

class Outputs {
 public:
  /// Throws InputError when the folder cannot be made or written, or when a file of it is one of `inputs`.
  Outputs(const std::filesystem::path& folder, std::span<const std::filesystem::path> inputs);

  /// Throws WriteError once something could not be written.
  void add_image(const ImageRecord& record);
  void add_predicted(const PredictedState& state);
  void set_summary(const std::string& json_text);
  /// Closes all files, then gives all of them their names. Throws WriteError.
  void commit();

 private:
  void write_headers();
  void write_state_row(const ImageRecord& record);
  void write_timing_row(const ImageRecord& record);
  void write_feature_rows(const ImageRecord& record);

  PendingFile trajectory_;
  PendingFile trajectory_imu_;
  PendingFile states_;
  PendingFile covariance_;
  PendingFile timing_;
  PendingFile features_;
  PendingFile summary_;
  /// All of them, in the order in which they get their names: with the summary the set is whole.
  const std::array<PendingFile*, 7> files_{&trajectory_, &trajectory_imu_, &states_, &covariance_,
                                           &timing_,     &features_,       &summary_};
};

}  // namespace plumb::replay
