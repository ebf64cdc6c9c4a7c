# wasp-doctor, and the wake-up measurement it shares with wasp-bench. Included from tools/CMakeLists.txt.
find_package(ZLIB REQUIRED)  # /proc/config.gz

add_library(wasp_wakeup STATIC cyclictest.cpp piped_child.cpp wakeups.cpp)
target_link_libraries(wasp_wakeup PUBLIC wasp_launcher wasp_flight_config)

add_library(wasp_doctor STATIC doctor_check.cpp doctor_cores.cpp doctor_devices.cpp doctor_kernel.cpp doctor_plan.cpp
  doctor_power.cpp doctor_preemption.cpp doctor_rights.cpp doctor_spin.cpp doctor_system.cpp doctor_wakeup.cpp)
target_link_libraries(wasp_doctor PUBLIC wasp_wakeup ZLIB::ZLIB)
wasp_program(wasp-doctor SOURCES doctor_main.cpp DEPENDS wasp_doctor)
