#pragma once
// Faults of the process: plumb-fsw itself, in real time, with emulated devices on real lines.

#include <functional>
#include <string>
#include <vector>

#include "test/faults/judge.h"

namespace plumb::faults {

struct ProcessFault {
  std::string name;
  std::string what;
  std::function<Verdict(const std::filesystem::path& folder)> run;  ///< name and text are filled in afterwards
};

std::vector<ProcessFault> process_faults();

Verdict run_and_judge(const ProcessFault& fault, const std::filesystem::path& folder);

}  // namespace plumb::faults
