# That the sanitizers work here at all: small programs with a fault each, which must be found, and without, which must
# live. The tests themselves run under the sanitizers with ./check --proof.
function(sanitized_program name compiler)
  set(program ${CMAKE_CURRENT_BINARY_DIR}/${name})
  add_custom_command(OUTPUT ${program}
    COMMAND ${compiler} -std=c++20 -O1 -g ${ARGN} -I${CMAKE_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/${name}_main.cpp
      -o ${program}
    DEPENDS ${name}_main.cpp ${CMAKE_SOURCE_DIR}/types/realtime.h
    VERBATIM)
  add_custom_target(wasp_${name} ALL DEPENDS ${program})
endfunction()

sanitized_program(rtsan_breaker ${WASP_CLANG} -fsanitize=realtime)
add_test(NAME proof.rtsan_ends_an_allocation COMMAND ${CMAKE_CURRENT_BINARY_DIR}/rtsan_breaker malloc)
add_test(NAME proof.rtsan_lets_good_code_live COMMAND ${CMAKE_CURRENT_BINARY_DIR}/rtsan_breaker)
set_tests_properties(proof.rtsan_ends_an_allocation PROPERTIES
  PASS_REGULAR_EXPRESSION "RealtimeSanitizer: unsafe-library-call.*`malloc`")
set_tests_properties(proof.rtsan_lets_good_code_live PROPERTIES PASS_REGULAR_EXPRESSION "nothing noticed")
set_tests_properties(proof.rtsan_ends_an_allocation proof.rtsan_lets_good_code_live PROPERTIES
  ENVIRONMENT "RTSAN_OPTIONS=suppressions=${CMAKE_CURRENT_SOURCE_DIR}/rtsan_suppressions.txt")

sanitized_program(tsan_breaker ${CMAKE_CXX_COMPILER} -fsanitize=thread -pthread)
add_test(NAME proof.tsan_finds_a_missing_order COMMAND ${CMAKE_CURRENT_BINARY_DIR}/tsan_breaker relaxed)
add_test(NAME proof.tsan_lets_good_code_live COMMAND ${CMAKE_CURRENT_BINARY_DIR}/tsan_breaker)
set_tests_properties(proof.tsan_finds_a_missing_order PROPERTIES PASS_REGULAR_EXPRESSION "ThreadSanitizer: data race")
set_tests_properties(proof.tsan_lets_good_code_live PROPERTIES FAIL_REGULAR_EXPRESSION "ThreadSanitizer")
