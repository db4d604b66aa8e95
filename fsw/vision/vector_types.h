#pragma once
// OpenCV's universal intrinsics, as wide as the processor that is built for: cv::v_uint8, cv::v_int16 and so on, read
// with cv::vx_load(). 16 bytes of SSE2 or NEON, 32 of AVX2. For what does not depend on the width: integers, and floats
// whose sums have an order of their own.

#if defined(__AVX2__)
// Outside of its own build OpenCV looks for SSE2 alone. In a namespace of their own, because files of the same program
// that are built without AVX2 use the narrow types too.
#include <immintrin.h>
#define CV_SSE3 1
#define CV_SSSE3 1
#define CV_SSE4_1 1
#define CV_AVX 1
#define CV_AVX2 1
#define CV_CPU_OPTIMIZATION_HAL_NAMESPACE hal_avx2
#define CV_CPU_OPTIMIZATION_HAL_NAMESPACE_BEGIN namespace hal_avx2 {
#define CV_CPU_OPTIMIZATION_HAL_NAMESPACE_END }
#endif

#include <opencv2/core/hal/intrin.hpp>
