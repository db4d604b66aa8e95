#include "fsw/base/assert.h"

#include <atomic>

namespace plumb {
namespace {
std::atomic<AssertHandler> g_handler{nullptr};
}

void set_assert_handler(AssertHandler handler) { g_handler.store(handler); }

void assert_failed(const AssertSite& site) {
  // Taken out before it is called: an assertion that breaks inside the handler, or on another thread meanwhile, traps
  // at once instead of calling the handler again.
  const AssertHandler handler = g_handler.exchange(nullptr);
  if (handler != nullptr) handler(site);
  __builtin_trap();
}

}  // namespace plumb
