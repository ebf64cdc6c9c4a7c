# wasp-eval: how well and how fast a vision kernel does on a recording. Included from tools/CMakeLists.txt.
find_package(fmt REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(OpenCV REQUIRED COMPONENTS core imgproc)  # image_shift needs its warps and its peer

# Recorded MAVLink logs: also the tests read them so.
add_library(wasp_mavlink_logs STATIC mavlink_damage.cpp mavlink_description.cpp mavlink_fields.cpp mavlink_log.cpp mavlink_scan.cpp)
target_link_libraries(wasp_mavlink_logs PUBLIC wasp_messages fmt::fmt nlohmann_json::nlohmann_json)

wasp_program(wasp-eval
  SOURCES eval_main.cpp eval_image_shift.cpp eval_image_shift_scenes.cpp eval_figures.cpp eval_truth.cpp eval_depth_plane.cpp eval_edge_height.cpp
          eval_motion.cpp eval_heading_rate.cpp eval_foe.cpp eval_time_to_contact.cpp
          eval_flow_grid.cpp eval_flow_pairs.cpp eval_flow_warps.cpp eval_flow_depth.cpp eval_mavlink.cpp
  DEPENDS wasp_mavlink_logs wasp_vision wasp_drivers fmt::fmt CLI11::CLI11 nlohmann_json::nlohmann_json)

# OpenCV is the peer of some evaluations; without it they print our figures alone.
find_package(OpenCV QUIET COMPONENTS core imgproc imgcodecs video)
if(OpenCV_FOUND)
  target_link_libraries(wasp-eval PRIVATE opencv_core opencv_imgproc opencv_imgcodecs opencv_video)
  target_compile_definitions(wasp-eval PRIVATE WASP_HAVE_OPENCV=1)
endif()
