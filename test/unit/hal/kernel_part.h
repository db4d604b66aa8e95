#pragma once
// Tests that need a part of the kernel which the host may lack. in_user_mode_linux.sh runs them under one that has it.

#include <gtest/gtest.h>

#include <cstdlib>

// A host's own interfaces are never touched.
#define PLUMB_NEEDS_KERNEL(part)                                                                         \
  if (std::getenv("PLUMB_TEST_KERNEL") == nullptr) {                                                     \
    GTEST_SKIP() << "needs " part " of a kernel made for the test, see test/target and buses_in_kernel"; \
  }
