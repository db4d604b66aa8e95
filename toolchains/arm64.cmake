# What every toolchain for 64-bit ARM Linux says, whatever the compiler: the system, where its headers and libraries are
# (toolchains/make-sysroot), the processor it is tuned for and how its programs are run here.
#
#   PLUMB_TUNING    generic         any ARMv8.0-A processor (the default)
#                   snapdragon820   Kryo, two and two cores of ARMv8.0-A
#                   snapdragon865   Kryo 585, cores derived from the Cortex-A77
#   PLUMB_SYSROOT   default: build/sysroot-arm64

set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)

set(PLUMB_TUNING generic CACHE STRING "Processor that the code is tuned for: generic, snapdragon820, snapdragon865")
cmake_path(GET CMAKE_CURRENT_LIST_DIR PARENT_PATH plumb_root)
set(PLUMB_SYSROOT ${plumb_root}/build/sysroot-arm64 CACHE PATH "Made by toolchains/make-sysroot")
# The compiler is tried out in projects of its own, which are told of these.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES PLUMB_TUNING PLUMB_SYSROOT)
if(NOT EXISTS ${PLUMB_SYSROOT}/usr/include)
  message(FATAL_ERROR "No sysroot in ${PLUMB_SYSROOT}: run tools/setup --arm64")
endif()

if(NOT DEFINED PLUMB_FLAGS_${PLUMB_TUNING})
  message(FATAL_ERROR "PLUMB_TUNING is '${PLUMB_TUNING}'; expected generic, snapdragon820 or snapdragon865")
endif()
foreach(language C CXX)
  set(CMAKE_${language}_FLAGS_INIT "${PLUMB_FLAGS_${PLUMB_TUNING}}")
endforeach()

set(CMAKE_SYSROOT ${PLUMB_SYSROOT})
set(CMAKE_FIND_ROOT_PATH ${PLUMB_SYSROOT})
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
foreach(kind LIBRARY INCLUDE PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64 -L ${PLUMB_SYSROOT})
# What is installed finds its libraries beside it (tools/package), and these find one another: by RPATH, since RUNPATH
# does not reach what a library needs itself.
set(CMAKE_EXE_LINKER_FLAGS_INIT "-Wl,--disable-new-dtags")
set(CMAKE_INSTALL_RPATH "$ORIGIN/../lib")
