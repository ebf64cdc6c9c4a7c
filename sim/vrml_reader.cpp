#include "sim/vrml_reader.h"

#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "sim/scene_bytes.h"
#include "sim/vrml_file.h"

namespace wasp::sim {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kLongestText = 60'000;  // a path, or an error
constexpr rlim_t kPatience_s = 60;            // processor time for one world

/// The child's answer: text of the error behind it, or so many bytes of a scene in the shared file.
struct Answer {
  std::uint8_t good = 0;
  std::uint64_t scene_bytes = 0;
};

void limit_time() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto until = static_cast<rlim_t>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + kPatience_s;
  const rlimit patience{until, RLIM_INFINITY};
  setrlimit(RLIMIT_CPU, &patience);
}

bool put(int fd, const std::vector<std::uint8_t>& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = pwrite(fd, bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
    if (n <= 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return true;
}

std::vector<std::uint8_t> get(int fd, std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  std::size_t done = 0;
  while (done < size) {
    const ssize_t n = pread(fd, bytes.data() + done, size - done, static_cast<off_t>(done));
    if (n <= 0) throw std::runtime_error("its scene was cut short");
    done += static_cast<std::size_t>(n);
  }
  return bytes;
}

std::string answer_to(const fs::path& file, const VrmlReader::Parse& parse, int scene_fd) {
  Answer answer;
  std::string error;
  try {
    const std::vector<std::uint8_t> bytes = scene_bytes(parse(file));
    if (!put(scene_fd, bytes)) throw std::runtime_error(file.string() + ": no memory for its scene");
    answer = {1, bytes.size()};
  } catch (const std::exception& e) {
    error = std::string(e.what()).substr(0, kLongestText);
  }
  return std::string(reinterpret_cast<const char*>(&answer), sizeof answer) + error;
}

/// The child: reads worlds until its parent closes the line.
[[noreturn]] void serve(int line, int scene_fd, const VrmlReader::Parse& parse) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int s : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGXCPU}) signal(s, SIG_DFL);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  std::vector<char> text(kLongestText);
  for (ssize_t n; (n = recv(line, text.data(), text.size(), 0)) > 0;) {
    limit_time();
    const std::string answer = answer_to(std::string(text.data(), static_cast<std::size_t>(n)), parse, scene_fd);
    if (send(line, answer.data(), answer.size(), MSG_NOSIGNAL) < 0) break;
  }
  _exit(0);
}

}  // namespace

void VrmlReader::start() {
  int ends[2];
  const int scene_fd = memfd_create("wasp-scene", MFD_CLOEXEC);
  if (scene_fd < 0 || socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) {
    if (scene_fd >= 0) close(scene_fd);
    throw std::runtime_error(std::string("no process to read it: ") + std::strerror(errno));
  }
  pid_ = fork();
  if (pid_ == 0) {
    close(ends[0]);
    serve(ends[1], scene_fd, parse_);
  }
  close(ends[1]);
  line_ = ends[0], scene_fd_ = scene_fd;
  if (pid_ > 0) return;
  const int why = errno;
  pid_ = 0;
  replace();
  throw std::runtime_error(std::string("no process to read it: ") + std::strerror(why));
}

std::string VrmlReader::end_of_child() {
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = 0;
  replace();
  if (WIFSIGNALED(status)) return strsignal(WTERMSIG(status));
  return "exit code " + std::to_string(WEXITSTATUS(status));
}

void VrmlReader::replace() {
  if (line_ >= 0) close(line_);
  if (scene_fd_ >= 0) close(scene_fd_);
  line_ = scene_fd_ = -1;
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    end_of_child();
  }
}

/// The scene; or nothing, and the child's error, which names the file. Throws when the child fails, not the file's
/// text.
std::optional<Scene> VrmlReader::ask(const fs::path& file, std::string& error) {
  if (pid_ == 0) start();
  std::vector<char> text(sizeof(Answer) + kLongestText);
  ssize_t n = send(line_, file.c_str(), std::min(file.string().size(), kLongestText), MSG_NOSIGNAL);
  if (n > 0)
    while ((n = recv(line_, text.data(), text.size(), 0)) < 0 && errno == EINTR) {
    }
  Answer answer;
  if (n < static_cast<ssize_t>(sizeof answer))
    throw std::runtime_error("the VRML library fails on this file: " + end_of_child());
  std::memcpy(&answer, text.data(), sizeof answer);
  if (answer.good != 0) return scene_of_bytes(get(scene_fd_, answer.scene_bytes));
  error.assign(text.data() + sizeof answer, static_cast<std::size_t>(n) - sizeof answer);
  return std::nullopt;
}

Scene VrmlReader::read(const fs::path& file) {
  std::string error;
  try {
    if (auto scene = ask(file, error)) return *std::move(scene);
  } catch (const std::runtime_error& e) {
    throw std::runtime_error(file.string() + ": " + e.what());
  }
  throw std::runtime_error(error);
}

Scene read_vrml(const fs::path& file) { return VrmlReader().read(file); }

}  // namespace wasp::sim
