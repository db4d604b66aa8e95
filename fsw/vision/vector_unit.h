#pragma once
// Which vector unit the image kernels are built for.

namespace plumb {

/// False where the kernels would end the process: they are built for AVX2, and this processor has none. Programs ask
/// before anything else.
bool vector_unit_present();
/// What to tell the user then.
inline constexpr const char* kVectorAdvice =
    "built for a processor with AVX2, which this one is not: build it here, or with cmake -D PLUMB_AVX2=OFF";

}  // namespace plumb
