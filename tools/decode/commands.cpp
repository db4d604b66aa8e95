#include "tools/decode/can_command.h"
#include "tools/decode/command.h"
#include "tools/decode/lidar_lite_command.h"
#include "tools/decode/stim300_command.h"

namespace plumb::decode {

std::vector<std::unique_ptr<Command>> commands() {
  std::vector<std::unique_ptr<Command>> all;
  all.push_back(make_stim300_command());
  all.push_back(make_lidar_lite_command());
  all.push_back(make_can_command());
  return all;
}

}  // namespace plumb::decode
