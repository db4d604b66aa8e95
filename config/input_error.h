#pragma once
// What is wrong with what the user gave: a file, a key, a line, an option. One message, exit code 2.

#include <stdexcept>

namespace plumb {

class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace plumb
