# wasp-recording: what a folder of recorded data is. Included from tools/CMakeLists.txt.
find_package(fmt REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
add_library(wasp_recording_facts STATIC recording_facts.cpp)
target_link_libraries(wasp_recording_facts PUBLIC wasp_options wasp_drivers PRIVATE fmt::fmt nlohmann_json::nlohmann_json)
wasp_program(wasp-recording SOURCES recording_main.cpp DEPENDS wasp_recording_facts fmt::fmt CLI11::CLI11)
