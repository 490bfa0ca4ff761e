# House rules of the build in one place: language, warnings, sanitizers, and the three kinds of target.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

# A third of the time of the default linker for what is large; Debian's binutils bring it.
include(CheckLinkerFlag)
check_linker_flag(CXX -fuse-ld=gold FORGESCAN_HAS_GOLD)
if(FORGESCAN_HAS_GOLD)
  add_link_options(-fuse-ld=gold)
endif()

set(FORGESCAN_SANITIZE "" CACHE STRING "Sanitizers, as in -fsanitize=")
set(FORGESCAN_WARNINGS -Wall -Wextra -Wconversion -Wshadow -Wnon-virtual-dtor -Werror)

add_library(forgescan_options INTERFACE)
target_compile_options(forgescan_options INTERFACE ${FORGESCAN_WARNINGS} -fno-math-errno -pthread)
# clang counts conversions of sign to -Wconversion, and does not know every warning that GCC is told to leave out.
target_compile_options(forgescan_options INTERFACE $<$<CXX_COMPILER_ID:Clang>:-Wno-sign-conversion>
                       $<$<CXX_COMPILER_ID:Clang>:-Wno-unknown-warning-option>)
# GCC's own garbage collection takes a tenth of a compilation; a source here never needs more than 1 GB without it.
target_compile_options(forgescan_options INTERFACE $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=2000000>)
target_include_directories(forgescan_options INTERFACE ${CMAKE_SOURCE_DIR})
if(FORGESCAN_SANITIZE)
  target_compile_options(forgescan_options INTERFACE -fsanitize=${FORGESCAN_SANITIZE}
                         -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(forgescan_options INTERFACE -fsanitize=${FORGESCAN_SANITIZE})
endif()

# Under clang its other warnings are not ours to obey.
if(FORGESCAN_FUZZ)
  target_compile_options(forgescan_options INTERFACE -Wno-error -w -fsanitize=fuzzer-no-link)
endif()

target_link_libraries(forgescan_options INTERFACE fmt::fmt)

# What nearly every source includes is compiled once, for the product here and for the tests in tests/: it takes a third off a
# clean build. The preset asan-ubsan builds without, so that every file still names what it needs.
file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/generated/common_headers.cc CONTENT "")
add_library(forgescan_headers OBJECT ${CMAKE_BINARY_DIR}/generated/common_headers.cc)
target_link_libraries(forgescan_headers PRIVATE forgescan_options Eigen3::Eigen)
set(FORGESCAN_COMMON_HEADERS <algorithm> <array> <cmath> <filesystem> <fmt/format.h> <functional> <map> <memory> <optional>
    <string> <vector> <Eigen/Geometry>)
target_precompile_headers(forgescan_headers PRIVATE ${FORGESCAN_COMMON_HEADERS})

# For sources in which no time is spent when they run, tests and command lines: it takes a quarter off their compile time.
set(FORGESCAN_QUICK_TO_BUILD $<$<CONFIG:Release>:-O1>)
add_library(forgescan_quick_headers OBJECT ${CMAKE_BINARY_DIR}/generated/common_headers.cc)
target_link_libraries(forgescan_quick_headers PRIVATE forgescan_options Eigen3::Eigen)
target_compile_options(forgescan_quick_headers PRIVATE ${FORGESCAN_QUICK_TO_BUILD})
target_precompile_headers(forgescan_quick_headers PRIVATE ${FORGESCAN_COMMON_HEADERS})

# What tests and the programs they start run with.
if(FORGESCAN_SANITIZE)
  set(FORGESCAN_TEST_ENVIRONMENT "LSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/tests/lsan.supp:print_suppressions=0"
      "TSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/tests/tsan.supp")
endif()

# forgescan_library(NAME [QUICK] SOURCES... DEPS targets...): a library; includes are written from the repository's root.
# QUICK: what it does takes no time, so that little is spent on optimising it.
function(forgescan_library name)
  cmake_parse_arguments(ARG "QUICK" "" "SOURCES;DEPS;PRIVATE_DEPS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC forgescan_options ${ARG_DEPS} PRIVATE ${ARG_PRIVATE_DEPS})
  if(ARG_QUICK)
    target_compile_options(${name} PRIVATE ${FORGESCAN_QUICK_TO_BUILD})
    target_precompile_headers(${name} REUSE_FROM forgescan_quick_headers)
  else()
    target_precompile_headers(${name} REUSE_FROM forgescan_headers)
  endif()
endfunction()

# What a user runs, without the tests: cmake --build --preset release --target programs.
add_custom_target(programs)

# forgescan_program(NAME SOURCES... DEPS targets... [HEADERS headers...]): an executable in <build>/bin. HEADERS: those every
# source of it includes, precompiled in place of the common ones; for a program of command lines, where no time is spent.
function(forgescan_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS;HEADERS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE forgescan_options ${ARG_DEPS})
  if(ARG_HEADERS)
    target_compile_options(${name} PRIVATE ${FORGESCAN_QUICK_TO_BUILD})
    target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
  else()
    target_precompile_headers(${name} REUSE_FROM forgescan_headers)
  endif()
  add_dependencies(programs ${name})
endfunction()

# forgescan_test(NAME SOURCES... DEPS targets... [NETWORK] [CASES...]): one GoogleTest program = one ctest entry; with CASES one
# entry NAME.CASE for each, which runs the tests of that name and fails if there are none. Paths reach the test
# as FORGESCAN_SOURCE_DIR (the repository) and FORGESCAN_BIN_DIR (programs). NETWORK gives it a network namespace of its own
# with loopback and LCM's multicast route, so that such tests run in parallel and need no host settings.
function(forgescan_test name)
  cmake_parse_arguments(ARG "NETWORK" "TIMEOUT" "SOURCES;DEPS;CASES" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE forgescan_options ${ARG_DEPS} GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE FORGESCAN_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
                             FORGESCAN_BIN_DIR="${CMAKE_BINARY_DIR}/bin")
  target_compile_options(${name} PRIVATE ${FORGESCAN_QUICK_TO_BUILD})
  target_precompile_headers(${name} REUSE_FROM forgescan_test_headers)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  set(command $<TARGET_FILE:${name}>)
  if(ARG_NETWORK)
    set(command ${CMAKE_SOURCE_DIR}/tools/with-network ${command})
  endif()
  set(entries ${name})
  if(ARG_CASES)
    list(TRANSFORM ARG_CASES PREPEND ${name}. OUTPUT_VARIABLE entries)
    foreach(case ${ARG_CASES})
      add_test(NAME ${name}.${case} COMMAND ${command} --gtest_filter=*.${case})
    endforeach()
    set_tests_properties(${entries} PROPERTIES FAIL_REGULAR_EXPRESSION "Running 0 tests")
  else()
    add_test(NAME ${name} COMMAND ${command})
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  if(FORGESCAN_SANITIZE)
    math(EXPR ARG_TIMEOUT "${ARG_TIMEOUT} * 5")
  endif()
  set_tests_properties(${entries} PROPERTIES TIMEOUT ${ARG_TIMEOUT})
  set_tests_properties(${entries} PROPERTIES ENVIRONMENT "${FORGESCAN_TEST_ENVIRONMENT}")
endfunction()

# uses_regex(TARGET): GCC 12 warns of std::regex's own members when sanitizers are on (a false alarm); only there, and only
# for targets that include <regex>, that warning is off.
function(uses_regex target)
  if(FORGESCAN_SANITIZE)
    target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized)
  endif()
endfunction()
