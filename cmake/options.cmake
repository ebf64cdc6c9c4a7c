# Compiler, warnings, sanitizers, and the three helpers the folders use.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
include(CTest)
include(GNUInstallDirs)

set(WASP_SANITIZE "" CACHE STRING "address, thread, realtime (clang >= 20) or empty")

find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)

add_library(wasp_options INTERFACE)
target_include_directories(wasp_options INTERFACE ${CMAKE_SOURCE_DIR} ${CMAKE_BINARY_DIR}/generated)
target_compile_options(wasp_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
  -Wnon-virtual-dtor -Wold-style-cast -Woverloaded-virtual -Wdouble-promotion -Wno-psabi)
# Floating point: identical results for identical input on one binary; no value-changing optimisation.
target_compile_options(wasp_options INTERFACE -ffp-contract=off -fno-math-errno)
target_link_libraries(wasp_options INTERFACE Threads::Threads)
if(WASP_SANITIZE STREQUAL "address")
  target_compile_options(wasp_options INTERFACE -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer -g)
  target_link_options(wasp_options INTERFACE -fsanitize=address,undefined)
elseif(WASP_SANITIZE STREQUAL "thread")
  target_compile_options(wasp_options INTERFACE -fsanitize=thread -g
    $<$<CXX_COMPILER_ID:GNU>:-Wno-tsan>)  # fences are not modelled: docs/contract.md says what that leaves unseen
  target_link_options(wasp_options INTERFACE -fsanitize=thread)
elseif(WASP_SANITIZE STREQUAL "realtime")
  target_compile_options(wasp_options INTERFACE -fsanitize=realtime -fno-omit-frame-pointer -g)
  target_link_options(wasp_options INTERFACE -fsanitize=realtime)
endif()

# wasp_library(name DEPENDS targets...): all .cpp files of the folder (and vision/kernels) as one static library.
function(wasp_library name)
  cmake_parse_arguments(ARG "" "" "DEPENDS;EXCLUDE" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "_main\\.cpp$")
  foreach(file ${ARG_EXCLUDE})
    list(REMOVE_ITEM sources ${CMAKE_CURRENT_SOURCE_DIR}/${file})
  endforeach()
  if(sources)
    add_library(${name} STATIC ${sources})
    target_link_libraries(${name} PUBLIC wasp_options Eigen3::Eigen ${ARG_DEPENDS})
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE wasp_options Eigen3::Eigen ${ARG_DEPENDS})
  endif()
endfunction()

# wasp_program(name SOURCES files... DEPENDS targets...): an installed program in the top of the build folder.
function(wasp_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE wasp_options ${ARG_DEPENDS})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR})
  install(TARGETS ${name})
endfunction()

# wasp_test(folder DEPENDS targets... [PROCESSORS n] [LOCK name]): tests/<folder>/*_test.cpp as one GoogleTest program, discovered by
# CTest. PROCESSORS 2 keeps a test that needs the machine to itself from running beside another under ctest -j 2;
# tests with the same LOCK never run at the same time.
function(wasp_test folder)
  cmake_parse_arguments(ARG "" "PROCESSORS;LOCK" "DEPENDS" ${ARGN})
  if(NOT ARG_PROCESSORS)
    set(ARG_PROCESSORS 1)
  endif()
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/tests/${folder}/*_test.cpp)
  if(NOT sources)
    return()
  endif()
  set(target test_${folder})
  add_executable(${target} ${sources})
  target_link_libraries(${target} PRIVATE ${ARG_DEPENDS} wasp_options GTest::gtest_main)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)  # run once
  target_compile_definitions(${target} PRIVATE WASP_SOURCE_DIR="${CMAKE_SOURCE_DIR}" WASP_BINARY_DIR="${CMAKE_BINARY_DIR}")
  gtest_discover_tests(${target} TEST_PREFIX "${folder}." DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 900 PROCESSORS ${ARG_PROCESSORS} RESOURCE_LOCK "${ARG_LOCK}")
endfunction()
