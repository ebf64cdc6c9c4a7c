// WASP_REALTIME: the mark of the real-time contract, on the declaration of every function a real-time thread may call.
// Such a function takes no lock, allocates nothing, throws nothing, makes no virtual call and has bounded loops. clang
// >= 20 proves it as a function effect over everything it calls; docs/contract.md says what else watches over it.
#pragma once

#if defined(__clang__) && __clang_major__ >= 20
#define WASP_REALTIME noexcept [[clang::nonblocking]]
#else
#define WASP_REALTIME noexcept
#endif
