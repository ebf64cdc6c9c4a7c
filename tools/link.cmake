# wasp-link: a look at an autopilot before any mission. Included from tools/CMakeLists.txt.
add_library(wasp_link_session STATIC bench_flight.cpp link_session.cpp)
target_link_libraries(wasp_link_session PUBLIC wasp_options wasp_scheduling wasp_control wasp_drivers fmt::fmt)
wasp_program(wasp-link SOURCES link_main.cpp DEPENDS wasp_link_session CLI11::CLI11)
