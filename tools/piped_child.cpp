#include "tools/piped_child.h"

#include <fcntl.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace wasp::tools {

PipedChild::Pipe PipedChild::open_pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));
  return {ends[0], ends[1]};
}

PipedChild::PipedChild(std::vector<std::string> arguments) : PipedChild(std::move(arguments), open_pipe()) {}

/// The child opens the write end by its name before it becomes another program.
PipedChild::PipedChild(std::vector<std::string> arguments, Pipe pipe)
    : fd_(pipe.read_end), child_(std::move(arguments), "/proc/self/fd/" + std::to_string(pipe.write_end)) {
  close(pipe.write_end);
}

PipedChild::~PipedChild() { close(fd_); }

}  // namespace wasp::tools
