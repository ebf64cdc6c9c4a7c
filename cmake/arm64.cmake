# Toolchain: Debian's cross compiler for arm64 and a root with arm64 libraries.
#   tools/rt_guest/fetch.sh arm64        # once: kernel and root, no rights needed; prints the folder
#   cmake -S . -B build-arm64 --toolchain cmake/arm64.cmake -DWASP_ARM64_ROOT=FOLDER/root -DWASP_FLIGHT_ONLY=ON
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)

set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES WASP_ARM64_ROOT)
if(NOT WASP_ARM64_ROOT)
  message(FATAL_ERROR "cmake/arm64.cmake needs -DWASP_ARM64_ROOT=FOLDER, a root with arm64 libraries (tools/rt_guest/fetch.sh)")
endif()
get_filename_component(CMAKE_SYSROOT ${WASP_ARM64_ROOT} ABSOLUTE)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH ${CMAKE_SYSROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${CMAKE_SYSROOT})
set(ENV{PKG_CONFIG_LIBDIR} ${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${CMAKE_SYSROOT}/usr/share/pkgconfig)
