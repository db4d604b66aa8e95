#pragma once
// Reads a folder in the ASL (EuRoC) layout with the range sensor of docs: mav0/{cam0,imu0,range0,state_groundtruth...}.
// Everything but the images is read and checked before the first tick, so that a bad file is told at once.

#include <filesystem>
#include <memory>
#include <vector>

#include "tools/replay/session.h"

namespace plumb::replay {

struct AslOptions {
  std::filesystem::path folder;      ///< the one that holds mav0, or mav0 itself
  std::filesystem::path parameters;  ///< explicit parameter file, empty for none; wins over the sensor.yaml files
  bool use_range = true;
};

/// Throws InputError naming the file, the key or line, and what was expected.
std::unique_ptr<Source> open_asl(const AslOptions& options);

}  // namespace plumb::replay
