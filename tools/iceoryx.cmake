# wasp-iceoryx: the gateway, the only program of the build folder's top (besides the benchmarks) that links iceoryx.
find_package(iceoryx_posh QUIET)

# What knows no iceoryx.
add_library(wasp_gateway STATIC iceoryx_daemon.cpp iceoryx_frame.cpp iceoryx_supervisor.cpp iceoryx_topics.cpp)
target_link_libraries(wasp_gateway PUBLIC wasp_observers)

if(iceoryx_posh_FOUND)
  wasp_program(wasp-iceoryx
    SOURCES iceoryx_main.cpp iceoryx_export.cpp iceoryx_import.cpp iceoryx_list.cpp iceoryx_runtime.cpp
    DEPENDS wasp_gateway iceoryx_posh::iceoryx_posh)
endif()

# Trials with a daemon of our own, for tests and benchmarks.
add_library(wasp_gateway_trials STATIC gateway_chaos.cpp roudi_process.cpp)
target_link_libraries(wasp_gateway_trials PUBLIC wasp_gateway wasp_launcher)
