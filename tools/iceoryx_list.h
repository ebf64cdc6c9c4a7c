// `wasp iceoryx list`: what could be exported, and what iceoryx offers at this moment.
#pragma once

namespace wasp::iceoryx {

/// Exit code of the program: 0 also when nothing runs, since that is an answer.
int run_list(bool json);

}  // namespace wasp::iceoryx
