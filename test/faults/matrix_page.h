#pragma once
// The verdicts as text for a terminal, and as a page of the documents.

#include <string>
#include <vector>

#include "test/faults/judge.h"

namespace plumb::faults {

std::string text_of(const Verdict& verdict);
std::string page_of(const std::vector<Verdict>& verdicts);

}  // namespace plumb::faults
