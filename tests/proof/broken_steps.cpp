// Breaks the rules of the symbol check on purpose: a step that reaches the allocator through a helper, and an import
// that no list has.
#include <unistd.h>

#include <vector>

namespace wasp::vision {

[[gnu::noinline]] void helper(std::vector<int>& values) { values.push_back(1); }
void broken_step(std::vector<int>& values) noexcept { helper(values); }
void waiting_step() noexcept { usleep(1); }

}  // namespace wasp::vision
