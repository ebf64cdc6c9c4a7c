# wasp-camera, and the configuration as programs read it that know no behaviours. Included from tools/CMakeLists.txt.
add_library(wasp_flight_config STATIC flight_config.cpp)
target_link_libraries(wasp_flight_config PUBLIC wasp_children wasp_config)

add_library(wasp_camera_process STATIC camera_bringup.cpp camera_capture.cpp camera_options.cpp camera_rings.cpp)
find_package(CLI11 REQUIRED)
target_link_libraries(wasp_camera_process PUBLIC wasp_live wasp_flight_config wasp_cameras wasp_children CLI11::CLI11)
wasp_program(wasp-camera SOURCES camera_main.cpp DEPENDS wasp_camera_process)
