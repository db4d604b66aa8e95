# 64-bit ARM with clang 19; see arm64.cmake.
set(CMAKE_C_COMPILER clang-19)
set(CMAKE_CXX_COMPILER clang++-19)
set(CMAKE_C_COMPILER_TARGET aarch64-linux-gnu)
set(CMAKE_CXX_COMPILER_TARGET aarch64-linux-gnu)

set(PLUMB_FLAGS_generic "-march=armv8-a")
set(PLUMB_FLAGS_snapdragon820 "-mcpu=kryo")
set(PLUMB_FLAGS_snapdragon865 "-mcpu=cortex-a77")

include(${CMAKE_CURRENT_LIST_DIR}/arm64.cmake)
