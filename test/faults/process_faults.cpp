#include "test/faults/process_faults.h"

namespace plumb::faults {

std::vector<ProcessFault> process_faults() { return {}; }

Verdict run_and_judge(const ProcessFault& fault, const std::filesystem::path& folder) {
  Verdict verdict = fault.run(folder);
  verdict.name = fault.name;
  verdict.what = fault.what;
  return verdict;
}

}  // namespace plumb::faults
