#pragma once
// What a port says of a device that cannot be opened.

#include <cerrno>
#include <cstring>
#include <string>

namespace plumb {

/// With the system's reason, where errno has one.
inline std::string open_error(const std::string& device, const char* wrong) {
  const std::string error = device + ": " + wrong;
  return errno != 0 ? error + ": " + std::strerror(errno) : error;
}

}  // namespace plumb
