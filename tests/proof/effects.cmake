# Each source of the folders with real-time code is checked, not compiled; again when it or a header of it changes.
set(include_folders $<REMOVE_DUPLICATES:$<TARGET_PROPERTY:wasp_scheduling,INCLUDE_DIRECTORIES>>)
set(flags -std=c++20 -fsyntax-only -Wno-everything -Werror=function-effects
  -include ${CMAKE_CURRENT_SOURCE_DIR}/assumed_nonblocking.h
  -I$<JOIN:$<FILTER:${include_folders},EXCLUDE,^/usr/include$>,$<SEMICOLON>-I>
  -DHWY_COMPILE_ONLY_STATIC)  # Highway for one instruction set: no table of function pointers to lose the trail in
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|amd64")
  set(level_narrow -march=x86-64-v2 -maes -mpclmul)  # SSE4
  set(level_wide -march=x86-64-v3 -maes -mpclmul)    # AVX2
endif()

set(stamps)
function(check_effects source level)
  set(stamp ${CMAKE_CURRENT_BINARY_DIR}/effects/${level}/${source}.ok)
  get_filename_component(folder ${stamp} DIRECTORY)
  file(MAKE_DIRECTORY ${folder})
  add_custom_command(OUTPUT ${stamp}
    COMMAND ${WASP_CLANG} ${flags} ${level_${level}} -MD -MT ${stamp} -MF ${stamp}.d ${CMAKE_SOURCE_DIR}/${source}
    COMMAND ${CMAKE_COMMAND} -E touch ${stamp}
    DEPENDS ${CMAKE_SOURCE_DIR}/${source} ${CMAKE_CURRENT_SOURCE_DIR}/assumed_nonblocking.h
    DEPFILE ${stamp}.d
    COMMENT "Function effects of ${source} (${level})"
    COMMAND_EXPAND_LISTS VERBATIM)
  set(stamps ${stamps} ${stamp} PARENT_SCOPE)
endfunction()

file(GLOB_RECURSE sources CONFIGURE_DEPENDS RELATIVE ${CMAKE_SOURCE_DIR} ${CMAKE_SOURCE_DIR}/rt/*.cpp
  ${CMAKE_SOURCE_DIR}/shm/*.cpp ${CMAKE_SOURCE_DIR}/messages/*.cpp ${CMAKE_SOURCE_DIR}/drivers/*.cpp
  ${CMAKE_SOURCE_DIR}/vision/*.cpp ${CMAKE_SOURCE_DIR}/control/*.cpp ${CMAKE_SOURCE_DIR}/scheduling/*.cpp)
foreach(source ${sources} behaviours.cpp wasp.cpp)
  check_effects(${source} narrow)
  file(STRINGS ${CMAKE_SOURCE_DIR}/${source} vectors REGEX "hwy/highway.h")
  # Highway's Reverse for AVX2 keeps its constants in a static table, which clang takes for a guarded one.
  file(STRINGS ${CMAKE_SOURCE_DIR}/${source} reverses REGEX "hn::Reverse\\(")
  if(vectors AND level_wide AND NOT reverses)
    check_effects(${source} wide)
  endif()
endforeach()
add_custom_target(wasp_effects DEPENDS ${stamps})
add_dependencies(wasp_effects wasp_message_headers)
add_test(NAME proof.effects COMMAND ${CMAKE_COMMAND} --build ${CMAKE_BINARY_DIR} --target wasp_effects -j 2)
set_tests_properties(proof.effects PROPERTIES PROCESSORS 2 TIMEOUT 1800)

# Each file in refused/ breaks the contract in one way, and must be refused for the reason it names.
file(GLOB refused CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/refused/*.cpp)
foreach(source ${refused})
  get_filename_component(name ${source} NAME_WE)
  file(STRINGS ${source} reason REGEX "^// Refused: ")
  string(REPLACE "// Refused: " "" reason "${reason}")
  add_test(NAME proof.refuses_${name} COMMAND ${WASP_CLANG} ${flags} ${source} COMMAND_EXPAND_LISTS)
  set_tests_properties(proof.refuses_${name} PROPERTIES PASS_REGULAR_EXPRESSION "error: [^\n]*${reason}")
endforeach()
