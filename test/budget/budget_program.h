#pragma once
// What the programs whose instructions are counted have in common: arguments and the end of main().

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <limits>

namespace plumb::budget {

/// How many images are to be flown, by an argument that may be left out: then all.
inline std::size_t images_wanted(int argc, char** argv, int position) {
  return position < argc ? std::strtoul(argv[position], nullptr, 10) : std::numeric_limits<std::size_t>::max();
}

/// The exit code of `run`; 1 for an exception, which is told on standard error.
inline int exit_code_of(int (*run)(int argc, char** argv), int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}

}  // namespace plumb::budget
