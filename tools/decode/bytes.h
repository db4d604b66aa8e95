#pragma once
// Captured bytes.

#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

namespace plumb::decode {

/// All bytes of a file, or of standard input for "-". Throws InputError.
std::vector<std::uint8_t> read_bytes(const std::string& file);
/// The same as text, to be taken line by line.
std::istringstream read_text(const std::string& file);

}  // namespace plumb::decode
