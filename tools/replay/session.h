#pragma once
// What a replay needs to know before its first tick, whatever it is read from, and the stream of ticks itself.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "fsw/app/nav_system.h"
#include "fsw/measurement/input_frame.h"
#include "fsw/measurement/nav_state.h"

namespace plumb::replay {

struct Session {
  std::string source;                         ///< what the user named, for messages and the summary
  std::vector<std::filesystem::path> inputs;  ///< files and folders that are read, not to be written over
  std::vector<std::string> warnings;          ///< what can be flown but is hardly meant, one sentence each
  std::string config_name;  ///< the configuration the log was flown with; empty when the source does not say
  Calibration calibration;
  Parameters parameters;
  std::size_t images = 0;  ///< in the whole source
  std::size_t imu_samples = 0;
  std::size_t ranges = 0;
  Time t_first_image;
  Time t_last_image;
  std::vector<NavState> truth;                             ///< without covariance; empty when there is none
  std::map<std::uint32_t, std::uint64_t> recorded_hashes;  ///< state hash by image sequence, if the source has them
};

/// One tick with the pixels of its camera frame. The pixels live until the next call of next().
struct Tick {
  InputFrame input;
  ImageView image;
};

class Source {
 public:
  virtual ~Source() = default;
  virtual const Session& session() const = 0;
  /// False at the end. Throws InputError when the data turn out bad.
  virtual bool next(Tick& tick) = 0;
};

}  // namespace plumb::replay
