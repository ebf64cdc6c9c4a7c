#Statistics of height from edges, and their figures.Included from tools / CMakeLists.txt.
add_library(wasp_edge_study STATIC edge_study.cpp edge_study_figures.cpp)
    target_link_libraries(wasp_edge_study PUBLIC wasp_observers wasp_sim_camera)
