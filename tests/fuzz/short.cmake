# The fuzzers in the ordinary build: compiled by clang-22 into build/fuzz as a project of their own, then each run a
# fixed number of times from its seeds with a fixed seed. campaign.sh runs the long counts.
add_executable(mavlink_mutants ${CMAKE_CURRENT_LIST_DIR}/mavlink_mutants_main.cpp)
target_link_libraries(mavlink_mutants PRIVATE wasp_messages wasp_options)
add_test(NAME fuzz.mavlink_mutants_accepted_are_collisions COMMAND mavlink_mutants --count 100000)

set(runs_flight_config 4000)
set(runs_sim_config 8000)
set(runs_recording 8000)
set(runs_fault_timeline 4000)
set(runs_vrml 2000)  # each world is first read by a child process
find_program(WASP_CLANG NAMES clang++-22)
file(GLOB corpora CONFIGURE_DEPENDS LIST_DIRECTORIES true RELATIVE ${CMAKE_CURRENT_LIST_DIR}/corpus ${CMAKE_CURRENT_LIST_DIR}/corpus/*)
if(WASP_CLANG AND NOT WASP_SANITIZE)
  add_custom_target(wasp_fuzz ALL
    COMMAND ${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${CMAKE_BINARY_DIR}/fuzz -G ${CMAKE_GENERATOR}
      -DCMAKE_CXX_COMPILER=${WASP_CLANG} -DWASP_GENERATED=${CMAKE_BINARY_DIR}/generated --log-level=WARNING
    COMMAND ${CMAKE_COMMAND} --build ${CMAKE_BINARY_DIR}/fuzz -j 2
    USES_TERMINAL
    COMMENT "Fuzzers (clang-22, sanitizers)")
  add_dependencies(wasp_fuzz wasp_message_headers)
endif()

foreach(name ${corpora})
  if(NOT TARGET wasp_fuzz)
    add_test(NAME fuzz.${name} COMMAND ${CMAKE_COMMAND} -E echo "skipped: no clang++-22, or a build with sanitizers of its own")
    set_tests_properties(fuzz.${name} PROPERTIES SKIP_REGULAR_EXPRESSION "skipped: ")
    continue()
  endif()
  file(GLOB seeds CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/corpus/${name}/*)
  list(JOIN seeds "," seeds)
  file(WRITE ${CMAKE_BINARY_DIR}/fuzz/seeds/${name} "${seeds}")
  if(NOT DEFINED runs_${name})
    set(runs_${name} 20000)
  endif()
  set(dictionary)
  if(EXISTS ${CMAKE_CURRENT_LIST_DIR}/${name}.dict)
    set(dictionary -dict=${CMAKE_CURRENT_LIST_DIR}/${name}.dict)
  endif()
  add_test(NAME fuzz.${name} COMMAND ${CMAKE_BINARY_DIR}/fuzz/fuzz_${name} -runs=${runs_${name}} -seed=1 -malloc_limit_mb=256
    -artifact_prefix=${CMAKE_BINARY_DIR}/fuzz/${name}. ${dictionary} -seed_inputs=@${CMAKE_BINARY_DIR}/fuzz/seeds/${name})
  set_tests_properties(fuzz.${name} PROPERTIES TIMEOUT 900)
endforeach()
# Coin leaks on worlds it refuses.
set_tests_properties(fuzz.vrml PROPERTIES ENVIRONMENT ASAN_OPTIONS=detect_leaks=0)
