# Build rules shared by every folder.
#
#   plumb_flight_library(NAME SOURCES ... DEPS ...)   flight code: no exceptions, no RTTI, all warnings are errors
#   plumb_host_library(NAME SOURCES ... DEPS ...)     host-side code: tools, hal, test support
#   plumb_executable(NAME SOURCES ... DEPS ...)       a program in build/<preset>/bin
#   plumb_test(NAME SOURCES ... DEPS ...)             a GoogleTest program registered with CTest

option(PLUMB_SANITIZE "Build with address and undefined-behaviour sanitizers" OFF)
option(PLUMB_COVERAGE "Build with coverage instrumentation" OFF)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
# -O3 for the matrix kernels; never fast-math: it removes the not-a-number checks the filter lives by.
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")

if(PLUMB_SANITIZE)
  add_compile_options(-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=address,undefined)
endif()
if(PLUMB_COVERAGE)
  add_compile_options(--coverage)
  add_link_options(--coverage)
endif()

set(PLUMB_WARNINGS -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion -Wdouble-promotion -Werror)

function(plumb_common target)
  target_include_directories(${target} PUBLIC ${PROJECT_SOURCE_DIR})
  target_compile_options(${target} PRIVATE ${PLUMB_WARNINGS})
endfunction()

function(plumb_flight_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  plumb_common(${name})
  target_link_libraries(${name} PUBLIC ${ARG_DEPS})
  target_compile_options(${name} PRIVATE -fno-exceptions -fno-rtti)
endfunction()

function(plumb_host_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  plumb_common(${name})
  target_link_libraries(${name} PUBLIC ${ARG_DEPS})
endfunction()

function(plumb_executable name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  plumb_common(${name})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS})
endfunction()

function(plumb_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  plumb_executable(${name} SOURCES ${ARG_SOURCES} DEPS ${ARG_DEPS} GTest::gtest GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 1200)
endfunction()
