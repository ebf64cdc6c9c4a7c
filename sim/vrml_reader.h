// VRML97 worlds read by a process of their own: the library Coin takes hostile files at their word, and whatever it
// dies of there is an error of the file here. The child is started with the first world, hands back the scene (judged
// by sim/scene_bytes.h) or the error, and reads the next; one that died is replaced. This process never runs Coin.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "sim/vrml_coin.h"

namespace wasp::sim {

class VrmlReader {
 public:
  /// What the child does with a file; throws std::runtime_error naming it.
  using Parse = std::function<Scene(const std::filesystem::path& file)>;
  explicit VrmlReader(Parse parse = read_vrml_with_coin) : parse_(std::move(parse)) {}
  ~VrmlReader() { replace(); }
  VrmlReader(const VrmlReader&) = delete;
  VrmlReader& operator=(const VrmlReader&) = delete;

  /// As read_vrml (sim/vrml_file.h); one call at a time. Throws std::runtime_error naming the file, also when the child
  /// died of it or took a minute of processor time.
  Scene read(const std::filesystem::path& file);
  /// Ends the child; the next world starts another.
  void replace();
  /// 0: no child just now.
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  void start();
  std::optional<Scene> ask(const std::filesystem::path& file, std::string& error);
  /// Reaps the child; what it died of.
  std::string end_of_child();

  Parse parse_;
  pid_t pid_ = 0;
  int line_ = -1, scene_fd_ = -1;
};

}  // namespace wasp::sim
