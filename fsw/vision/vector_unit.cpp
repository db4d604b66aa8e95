#include "fsw/vision/vector_unit.h"

namespace plumb {

bool vector_unit_present() {
#if defined(__AVX2__)
  return __builtin_cpu_supports("avx2") != 0;
#else
  return true;
#endif
}

}  // namespace plumb
