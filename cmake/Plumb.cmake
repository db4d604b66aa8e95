# Build rules shared by every folder.
#
#   plumb_flight_library(NAME SOURCES ... DEPS ...)   flight code: no exceptions, no RTTI, all warnings are errors
#   plumb_host_library(NAME SOURCES ... DEPS ...)     host-side code: tools, hal, test support
#   plumb_executable(NAME SOURCES ... DEPS ...)       a program in build/<preset>/bin
#   plumb_reads_arguments(FILE)                       the main.cpp of a tool: compiled with less optimisation
#   plumb_test(NAME SOURCES ... DEPS ... [LABEL unit|law|replay|campaign])
#                                                     a GoogleTest program, each of its cases registered with CTest:
#       unit      one piece of code against its documented contract (the default)
#       law       a mathematical law that must hold over random inputs, whatever the implementation
#       replay    a recorded flight; may need the data folder, and skips without it
#       campaign  statistics over many simulated flights: minutes
#   plumb_check(NAME COMMAND ...)                     a rule of the house checked by a script, label `check`
#
# The targets plumb_tests_unit, plumb_tests_law, ... build the programs of one label.
# The global property PLUMB_FLIGHT_LIBRARIES lists every flight library, for the symbol scan.

option(PLUMB_SANITIZE "Build with address and undefined-behaviour sanitizers" OFF)
option(PLUMB_COVERAGE "Build with coverage instrumentation" OFF)
option(PLUMB_EXACT "Arithmetic that gives the same bits on every machine" OFF)
set(PLUMB_CONTRACTION off CACHE STRING "off; fast shows what fused multiplications do to the bits of the profile exact")
option(PLUMB_FUZZ "Add the fuzz targets, which need clang" OFF)
# Where clang looks anyway in a sysroot, of which CMake learns with gcc alone: named once more it would be looked at too
# early, before the headers of C++.
if(CMAKE_SYSROOT)
  list(APPEND CMAKE_CXX_IMPLICIT_INCLUDE_DIRECTORIES ${CMAKE_SYSROOT}/usr/include)
endif()
if(NOT DEFINED PLUMB_AVX2)
  include(CheckCXXSourceRuns)
  if(CMAKE_CROSSCOMPILING)
    set(PLUMB_AVX2_HERE OFF)
  else()
    check_cxx_source_runs("int main() { return __builtin_cpu_supports(\"avx2\") ? 0 : 1; }" PLUMB_AVX2_HERE)
  endif()
endif()
option(PLUMB_AVX2 "Image kernels for x86 with AVX2 (default: when the machine that builds has it)" ${PLUMB_AVX2_HERE})
set(PLUMB_POSES "" CACHE STRING "Poses in the sliding window of the flight configuration (default: as shipped)")
set(PLUMB_FEATURES "" CACHE STRING "Features in the state of the flight configuration (default: as shipped)")

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
# ccache knows a file by what it includes, and takes a precompiled header for a reason to compile everything again.
if(CMAKE_CXX_COMPILER_LAUNCHER MATCHES "ccache")
  set(CMAKE_DISABLE_PRECOMPILE_HEADERS ON)
endif()
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
# -O3 for the matrix kernels; never fast-math: it removes the not-a-number checks the filter lives by.
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")

if(PLUMB_POSES AND PLUMB_FEATURES)
  add_compile_definitions(PLUMB_POSES=${PLUMB_POSES} PLUMB_FEATURES=${PLUMB_FEATURES})
elseif(PLUMB_POSES OR PLUMB_FEATURES)
  message(FATAL_ERROR "PLUMB_POSES and PLUMB_FEATURES: expected both or neither")
endif()

if(PLUMB_EXACT)
  # What the compiler contracts and in which order Eigen's vector units add depends on the machine. The kernels of
  # fsw/math and fsw/vision keep their vectors: they fix the order of sums themselves, or add integers.
  add_compile_options(-ffp-contract=${PLUMB_CONTRACTION})
  add_compile_definitions(EIGEN_DONT_VECTORIZE)
endif()

if(PLUMB_SANITIZE)
  # Without NDEBUG, so that Eigen checks sizes and indices too.
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1")
  add_compile_options(-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=address,undefined)
endif()
if(PLUMB_COVERAGE)
  add_compile_options(--coverage)
  add_link_options(--coverage)
endif()

set(PLUMB_WARNINGS -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion -Wdouble-promotion)
if(CMAKE_CXX_COMPILER_ID STREQUAL Clang)
  list(APPEND PLUMB_WARNINGS -Wno-deprecated-declarations)  # std::stable_sort of libstdc++ 12 uses what it deprecates
endif()
if(NOT PLUMB_SANITIZE AND NOT PLUMB_COVERAGE)  # instrumentation misleads the compiler's flow analysis
  list(APPEND PLUMB_WARNINGS -Werror)
endif()

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
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    target_compile_options(${name} PRIVATE -fstack-usage)  # one .su file beside each object, for tools/budget
  endif()
  set_property(GLOBAL APPEND PROPERTY PLUMB_FLIGHT_LIBRARIES ${name})
endfunction()

# The source files of folders of fsw, for a program that compiles them anew in its own way.
function(plumb_flight_sources out)
  foreach(folder IN LISTS ARGN)
    get_target_property(sources plumb_${folder} SOURCES)
    list(TRANSFORM sources PREPEND ${PROJECT_SOURCE_DIR}/fsw/${folder}/)
    list(APPEND all ${sources})
  endforeach()
  set(${out} ${all} PARENT_SCOPE)
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

# The main.cpp of a tool, which reads arguments once: optimised further, the code of CLI11 takes twice the time to compile.
# Not for programs that fly: of an inline function that both have, the linker takes one.
function(plumb_reads_arguments file)
  set_source_files_properties(${file} PROPERTIES COMPILE_OPTIONS $<$<CONFIG:Release>:-O1>)
endfunction()

set(PLUMB_TEST_LABELS unit law replay campaign)
foreach(label IN LISTS PLUMB_TEST_LABELS)
  add_custom_target(plumb_tests_${label})
endforeach()

function(plumb_test name)
  cmake_parse_arguments(ARG "" "LABEL;FILTER" "SOURCES;DEPS" ${ARGN})
  if(NOT ARG_LABEL)
    set(ARG_LABEL unit)
  endif()
  if(NOT ARG_LABEL IN_LIST PLUMB_TEST_LABELS)
    message(FATAL_ERROR "plumb_test(${name}): LABEL ${ARG_LABEL} is not one of: ${PLUMB_TEST_LABELS}")
  endif()
  plumb_executable(${name} SOURCES ${ARG_SOURCES} DEPS ${ARG_DEPS} plumb_test_support GTest::gtest GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
  target_precompile_headers(${name} REUSE_FROM plumb_test_headers)
  add_dependencies(plumb_tests_${ARG_LABEL} ${name})
  if(NOT ARG_FILTER)
    set(ARG_FILTER "*")
  endif()
  gtest_discover_tests(${name} TEST_FILTER ${ARG_FILTER} DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT 1200 LABELS ${ARG_LABEL})
endfunction()

function(plumb_check name)
  cmake_parse_arguments(ARG "" "" "COMMAND" ${ARGN})
  add_test(NAME check.${name} COMMAND ${ARG_COMMAND} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  set_tests_properties(check.${name} PROPERTIES LABELS check TIMEOUT 300)
endfunction()
