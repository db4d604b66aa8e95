# 64-bit ARM with gcc; see arm64.cmake.
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)

set(PLUMB_FLAGS_generic "-march=armv8-a")
set(PLUMB_FLAGS_snapdragon820 "-march=armv8-a+crc+crypto -mtune=cortex-a57")  # gcc 12 does not know Kryo
set(PLUMB_FLAGS_snapdragon865 "-mcpu=cortex-a77")

include(${CMAKE_CURRENT_LIST_DIR}/arm64.cmake)
