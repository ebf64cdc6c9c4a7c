// The control socket: a UNIX SOCK_SEQPACKET socket in the file system, one request a packet, one reply a packet. Only
// the owner may connect (mode 0600). It waits for nobody: a client that does not read its reply is dropped.
#pragma once

#include <sys/types.h>

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "types/time.h"

namespace wasp::scheduling {

class FaultSocket {
 public:
  static constexpr std::size_t kLongestPath = 107;
  static constexpr std::size_t kMostClients = 8;
  using Answer = std::function<std::string(std::string_view request)>;

  /// Listens at `path`. A socket there whose owner has died is replaced; anything else stays and is an error. Throws
  /// std::runtime_error naming the path.
  explicit FaultSocket(std::string path);
  /// Takes its file away.
  ~FaultSocket();
  FaultSocket(const FaultSocket&) = delete;
  FaultSocket& operator=(const FaultSocket&) = delete;

  /// Answers what comes until `deadline_ns`, or until something has come.
  void serve(TimeNs deadline_ns, const Answer& answer);
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  void accept_client();
  /// False: the client is to be dropped.
  bool serve_client(int fd, const Answer& answer);

  std::string path_;
  int listener_ = -1;
  dev_t device_ = 0;
  ino_t inode_ = 0;
  std::vector<int> clients_;
  TimeNs deaf_until_ns_ = 0;  ///< no descriptor was left for another client
};

}  // namespace wasp::scheduling
