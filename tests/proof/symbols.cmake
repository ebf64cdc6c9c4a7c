# The check reads the disassembly of programs that link whole archives: the real ones, and one that breaks the rule.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
add_executable(wasp_symbols whole_archive_main.cpp)
target_link_libraries(wasp_symbols PRIVATE "$<LINK_LIBRARY:WHOLE_ARCHIVE,wasp_vision,wasp_control>" wasp_options)
add_test(NAME proof.symbols COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/symbols.py
  --nm ${CMAKE_NM} --objdump ${CMAKE_OBJDUMP} --list ${CMAKE_CURRENT_SOURCE_DIR}/symbols.txt
  --program $<TARGET_FILE:wasp_symbols> $<TARGET_FILE:wasp_vision> $<TARGET_FILE:wasp_control>)

add_library(wasp_broken_steps STATIC broken_steps.cpp)
target_link_libraries(wasp_broken_steps PRIVATE wasp_options)
add_executable(wasp_symbols_broken whole_archive_main.cpp)
target_link_libraries(wasp_symbols_broken PRIVATE "$<LINK_LIBRARY:WHOLE_ARCHIVE,wasp_broken_steps>" wasp_options)
add_test(NAME proof.symbols_refuses COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/symbols.py
  --nm ${CMAKE_NM} --objdump ${CMAKE_OBJDUMP} --list ${CMAKE_CURRENT_SOURCE_DIR}/symbols.txt
  --program $<TARGET_FILE:wasp_symbols_broken> $<TARGET_FILE:wasp_broken_steps>)
# In the order of the output: an unlisted import, a step that allocates through a helper, a line nothing fits.
set_tests_properties(proof.symbols_refuses PROPERTIES PASS_REGULAR_EXPRESSION
  "import [^\n]*usleep, which is not.*broken_step\\([^\n]*only a start-up function.*symbols.txt:[0-9]+: nothing fits")
