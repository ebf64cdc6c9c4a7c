// The two sweeps of edge_rows in SIMD, dispatched at run time to the widest instruction set of the machine.
#pragma once

#include "types/realtime.h"
#include "vision/kernels/edge_rows_reference.h"

namespace wasp::vision {

/// As the functions of edge_rows_reference.h, to the last bit. Realtime-safe: yes.
std::uint64_t gradient_squares(const GrayView& image, EdgeKind kind) WASP_REALTIME;
void count_rows(const EdgeSweep& sweep, EdgeRows& out) WASP_REALTIME;

}  // namespace wasp::vision
