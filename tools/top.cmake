# wasp-top, and what every observer of a running flight shares. Included from tools/CMakeLists.txt.
find_package(fmt REQUIRED)

add_library(wasp_live STATIC
  camera_figures.cpp csv_rows.cpp latency_summary.cpp record_attachment.cpp top_snapshot.cpp top_text.cpp)
target_include_directories(wasp_live SYSTEM PUBLIC ${EIGEN3_INCLUDE_DIRS})
target_link_libraries(wasp_live PUBLIC wasp_options wasp_shm fmt::fmt)

wasp_program(wasp-top SOURCES top_main.cpp DEPENDS wasp_live)
