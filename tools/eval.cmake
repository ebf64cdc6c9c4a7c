# wasp-eval: how well and how fast a vision kernel does on a recording. Included from tools/CMakeLists.txt.
find_package(fmt REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)

wasp_program(wasp-eval
  SOURCES eval_main.cpp eval_figures.cpp eval_truth.cpp eval_depth_plane.cpp eval_edge_height.cpp
  DEPENDS wasp_vision wasp_drivers fmt::fmt CLI11::CLI11 nlohmann_json::nlohmann_json)
