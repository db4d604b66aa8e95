#include "fsw/base/assert.h"

namespace plumb {
namespace {
AssertHandler g_handler = nullptr;
}

void set_assert_handler(AssertHandler handler) { g_handler = handler; }

void assert_failed(const AssertSite& site) {
  if (g_handler != nullptr) g_handler(site);
  __builtin_trap();
}

}  // namespace plumb
