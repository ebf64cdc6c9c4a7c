# The observers: programs that map the shared memory read-only. Included from tools/CMakeLists.txt.
# What they share, and what tests/tools links against.
add_library(wasp_observers STATIC
  csv_file.cpp csv_table.cpp quantiles.cpp
  record_files.cpp record_frames.cpp record_image_pool.cpp record_session.cpp
  report_data.cpp report_figures.cpp report_histogram.cpp report_page.cpp report_plot.cpp report_series.cpp report_style.cpp)
target_include_directories(wasp_observers SYSTEM PUBLIC ${EIGEN3_INCLUDE_DIRS})
target_link_libraries(wasp_observers PUBLIC wasp_live wasp_drivers)

wasp_program(wasp-record SOURCES record_main.cpp DEPENDS wasp_observers)
wasp_program(wasp-report SOURCES report_main.cpp DEPENDS wasp_observers)
