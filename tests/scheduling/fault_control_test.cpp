// Who throws the points: on time by the mission's milestones, over the socket in plain words, and never because of what
// a stranger sends.
#include "scheduling/fault_control.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <mutex>

#include "rt/clock.h"
#include "scheduling/fault_random.h"
#include "scheduling/fault_request.h"

namespace wasp::scheduling {
namespace {

namespace fs = std::filesystem;

class FaultControlTest : public ::testing::Test {
 protected:
  FaultControlTest() : folder_(fs::temp_directory_path() / ("wasp_faults_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~FaultControlTest() override { fs::remove_all(folder_); }
  FaultSetup setup(const std::string& timeline = {}, bool socket = false) {
    FaultSetup s{{}, {}, {{"first", "", "third"}, true}};
    if (!timeline.empty()) {
      s.timeline = (folder_ / "t.toml").string();
      std::ofstream(s.timeline) << timeline;
    }
    if (socket) s.socket = socket_path();
    return s;
  }
  std::string socket_path() const { return (folder_ / "s").string(); }
  FaultControl::Log log() {
    return [this](const std::string& line) {
      const std::lock_guard lock(mutex_);
      lines_.push_back(line);
    };
  }
  bool said(const std::string& words) {
    const std::lock_guard lock(mutex_);
    for (const auto& line : lines_)
      if (line.find(words) != std::string::npos) return true;
    return false;
  }
  static std::string error_of(const FaultSetup& s) {
    try {
      FaultControl control(s, [](const std::string&) {});
    } catch (const std::exception& e) {
      return e.what();
    }
    return {};
  }
  fs::path folder_;
  std::mutex mutex_;
  std::vector<std::string> lines_;
  MissionMarks marks_;
};

/// The other end.
class Client {
 public:
  explicit Client(const std::string& path) : fd_(socket(AF_UNIX, SOCK_SEQPACKET, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    connected_ = connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    const timeval patience{60, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  ~Client() { close(fd_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  [[nodiscard]] bool connected() const { return connected_; }
  std::string ask(std::string_view request) {
    if (send(fd_, request.data(), request.size(), MSG_NOSIGNAL) < 0) return "not sent";
    return hear();
  }
  std::string hear() {
    std::string reply(65'536, '\0');
    const ssize_t n = recv(fd_, reply.data(), reply.size(), 0);
    reply.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    return reply;
  }

 private:
  int fd_;
  bool connected_ = false;
};

TEST_F(FaultControlTest, ATimelineRunsByTheMilestonesOfTheMission) {
  FaultControl control(setup("[[fault]]\nat_s = 2\nwhat = \"camera.drop\"\nfor_s = 1\nvalue = 0.25\n"
                             "[[fault]]\nat_s = 0\nafter = \"armed\"\nwhat = \"behaviour.silent\"\nfor_s = 1\n"
                             "behaviour = \"third\"\n"
                             "[[fault]]\nat_s = 1\nafter = \"landing\"\nwhat = \"imu.stop\"\nfor_s = 1\n"),
                       log());
  EXPECT_TRUE(said("FAULTS ARMED: timeline " + (folder_ / "t.toml").string() + " (3 faults)"));
  const FaultBoard& board = control.board();
  TimeNs t = kSecond;
  EXPECT_EQ(control.look(marks_, t), t + FaultControl::kPatience);
  marks_.reach(Milestone::kStart, t);
  control.look(marks_, t + 2 * kSecond - 1);
  EXPECT_FALSE(board.on(FaultPoint::kCameraDrop, t + 2 * kSecond - 1));
  EXPECT_EQ(control.look(marks_, t + 2 * kSecond - 1), t + 2 * kSecond);  // looks again right when it falls due
  control.look(marks_, t += 2 * kSecond);
  EXPECT_TRUE(board.on(FaultPoint::kCameraDrop, t));
  EXPECT_FLOAT_EQ(board.value(FaultPoint::kCameraDrop), 0.25f);
  EXPECT_TRUE(said("fault: camera.drop on for 1 s, 0.25 share"));
  marks_.reach(Milestone::kArmed, t);
  marks_.reach(Milestone::kArmed, t + kSecond);  // only the first time counts
  control.look(marks_, t += kSecond);
  EXPECT_FALSE(board.on(FaultPoint::kCameraDrop, t));
  EXPECT_TRUE(said("fault: camera.drop off"));
  EXPECT_TRUE(board.on(FaultPoint::kBehaviourSilent, t, 2));
  EXPECT_FALSE(board.on(FaultPoint::kBehaviourSilent, t, 0));
  EXPECT_TRUE(said("fault: behaviour.silent on for 1 s, behaviour third"));
  control.stop();
  EXPECT_FALSE(board.on(FaultPoint::kBehaviourSilent, t, 2));
  EXPECT_TRUE(said("fault: behaviour.silent off"));
  EXPECT_TRUE(said("fault: imu.stop never fell due (1 s after landing)"));
}

TEST_F(FaultControlTest, AFlightStartedAgainDoesNotRunItsTimelineTwice) {
  FaultSetup s = setup("[[fault]]\nat_s = 0\nwhat = \"process.segv\"\n");
  s.timeline_over = true;
  FaultControl control(s, log());
  marks_.reach(Milestone::kStart, 1);
  control.look(marks_, kSecond);
  EXPECT_TRUE(said("not again"));
}

TEST_F(FaultControlTest, RequestsAreAnsweredInPlainWords) {
  FaultControl control(setup(), log());
  EXPECT_EQ(control.answer("inject camera.late for 0.5 value 80", 1000), "ok camera.late at 1000");
  EXPECT_TRUE(control.board().on(FaultPoint::kCameraLate, 1000));
  EXPECT_FLOAT_EQ(control.board().value(FaultPoint::kCameraLate), 80.f);
  EXPECT_EQ(control.answer("  inject  behaviour.spin behaviour third for 1\n", 5), "ok behaviour.spin at 5");
  EXPECT_NE(control.answer("status", 1000).find("camera.late on for 0.5 s, 80 ms; 0.500 s to go\n"), std::string::npos);
  EXPECT_EQ(control.answer("clear camera.late", 2000), "ok");
  EXPECT_FALSE(control.board().on(FaultPoint::kCameraLate, 2000));
  EXPECT_TRUE(control.board().on(FaultPoint::kBehaviourSpin, 2000, 2));
  EXPECT_EQ(control.answer("clear", 2000), "ok");
  EXPECT_EQ(control.answer("status", 2000), "nothing is on\n");
  const std::string list = control.answer("list", 0);
  EXPECT_EQ(std::count(list.begin(), list.end(), '\n'), static_cast<long>(kFaultPoints));
  EXPECT_NE(list.find("camera.freeze"), std::string::npos);
}

TEST_F(FaultControlTest, AWrongRequestIsAnErrorAndThrowsNoPoint) {
  FaultControl control(setup(), log());
  for (const char* wrong : {"",
                            " ",
                            "\n",
                            "inject",
                            "inject camera.late",
                            "inject camera.late for",
                            "inject camera.late for x",
                            "inject camera.late for 1 value",
                            "inject camera.late for 1 value nan",
                            "inject camera.late for inf",
                            "inject camera.late for -1",
                            "inject camera.late for 1 for 2",
                            "inject camera.late for 1e308 value 1e400",
                            "inject camera.lat for 1",
                            "inject behaviour.spin for 1 behaviour second",
                            "inject camera.late for 1 behaviour third",
                            "inject camera.late for 1\ninject imu.nan for 1",
                            "clear camera",
                            "clear imu.nan imu.stop",
                            "list all",
                            "status x",
                            "INJECT camera.late for 1",
                            "quit",
                            "inject imu.nan for 1 value 3"}) {
    EXPECT_EQ(control.answer(wrong, 1).rfind("error ", 0), 0u) << wrong << " -> " << control.answer(wrong, 1);
    EXPECT_EQ(control.answer("status", 1), "nothing is on\n") << wrong;
  }
}

TEST_F(FaultControlTest, AnyBytesAreAnsweredAndNeverThrowAPoint) {
  FaultControl control(setup(), log());
  FaultRandom random;
  const std::string seed = "inject camera.late for 0.5 value 80 behaviour third";
  for (int i = 0; i < 200'000; ++i) {
    std::string text = i % 2 == 0 ? std::string(random.below(kLongestRequest + 100), 'x') : seed;
    if (i % 2 == 0)
      for (char& c : text) c = static_cast<char>(random.next());
    else
      for (int k = 0; k < 3; ++k)
        text[random.below(static_cast<std::uint32_t>(text.size()))] = static_cast<char>(random.next());
    const std::string reply = control.answer(text, 1);
    EXPECT_TRUE(reply.rfind("error ", 0) == 0) << reply;  // the seed itself is refused: not aimed at a behaviour
  }
  EXPECT_EQ(control.answer("status", 1), "nothing is on\n");
}

TEST_F(FaultControlTest, TheSocketIsTheOwnersAloneAndGoneAtTheEnd) {
  {
    FaultControl control(setup({}, true), log());
    EXPECT_TRUE(said("FAULTS ARMED: socket " + socket_path()));
    struct stat made {};
    ASSERT_EQ(lstat(socket_path().c_str(), &made), 0);
    EXPECT_TRUE(S_ISSOCK(made.st_mode));
    EXPECT_EQ(made.st_mode & 07777, 0600u);
    EXPECT_NE(error_of(setup({}, true)).find("another process listens there"), std::string::npos);
  }
  EXPECT_FALSE(fs::exists(socket_path()));
}

TEST_F(FaultControlTest, ADeadSocketIsReplacedAndAnythingElseStays) {
  const int dead = socket(AF_UNIX, SOCK_SEQPACKET, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  socket_path().copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  close(dead);
  EXPECT_EQ(error_of(setup({}, true)), "");
  std::ofstream(socket_path()) << "precious";
  EXPECT_NE(error_of(setup({}, true)).find("exists and is not a socket"), std::string::npos);
  EXPECT_TRUE(fs::is_regular_file(socket_path()));
  fs::remove(socket_path());
  fs::create_symlink(folder_ / "elsewhere", socket_path());
  EXPECT_NE(error_of(setup({}, true)).find("exists and is not a socket"), std::string::npos);
}

TEST_F(FaultControlTest, APathTheKernelCannotTakeIsRefusedWithItsLength) {
  FaultSetup s = setup();
  s.socket = "/tmp/" + std::string(103, 'x');
  EXPECT_NE(error_of(s).find("has 108 bytes; the kernel takes 1 ... 107"), std::string::npos);
  s.socket = "/nonexistent/x";
  EXPECT_NE(error_of(s).find("No such file"), std::string::npos);
}

TEST_F(FaultControlTest, HostileClientsGetErrorsAndOthersAreServed) {
  FaultControl control(setup({}, true), log());
  marks_.reach(Milestone::kStart, rt::now());
  control.start(marks_);
  Client good(socket_path()), bad(socket_path());
  ASSERT_TRUE(good.connected() && bad.connected());
  EXPECT_EQ(bad.ask(std::string(100'000, 'A')).rfind("error ", 0), 0u);
  EXPECT_EQ(bad.ask(std::string("inject\0camera.drop for 1", 24)).rfind("error ", 0), 0u);
  EXPECT_EQ(bad.ask("\xff\xfe\x80").rfind("error ", 0), 0u);
  EXPECT_EQ(good.ask("inject imu.nan for 3600").rfind("ok imu.nan at ", 0), 0u);
  EXPECT_TRUE(control.board().on(FaultPoint::kImuNan, rt::now()));
  std::vector<std::unique_ptr<Client>> crowd;
  for (int i = 0; i < 6; ++i) crowd.push_back(std::make_unique<Client>(socket_path()));
  for (auto& client : crowd) EXPECT_EQ(client->ask("clear camera.drop"), "ok");
  Client ninth(socket_path());
  EXPECT_EQ(ninth.hear(), "error too many clients");
  crowd.clear();  // they hang up without a word
  for (int i = 0; i < 3; ++i) {
    Client passing(socket_path());
    ASSERT_TRUE(passing.connected());
  }
  EXPECT_NE(good.ask("status").find("imu.nan on for 3600 s"), std::string::npos);
  EXPECT_EQ(good.ask("clear"), "ok");
  EXPECT_FALSE(control.board().on(FaultPoint::kImuNan, rt::now()));
}

TEST_F(FaultControlTest, WithoutDescriptorsTheSocketStillServesWhoIsConnected) {
  FaultControl control(setup({}, true), log());
  control.start(marks_);
  Client client(socket_path());
  ASSERT_EQ(client.ask("inject process.descriptors for 3600").rfind("ok", 0), 0u);
  EXPECT_LT(open("/dev/null", O_RDONLY), 0);
  EXPECT_EQ(errno, EMFILE);
  EXPECT_NE(client.ask("status").find("process.descriptors on"), std::string::npos);
  EXPECT_EQ(client.ask("clear"), "ok");
  const int fd = open("/dev/null", O_RDONLY);
  EXPECT_GE(fd, 0);
  close(fd);
}

using FaultControlDeathTest = FaultControlTest;

TEST_F(FaultControlDeathTest, TheProcessEndsByTheSignalOfItsFault) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto die = [this](const char* what) {
    FaultControl control(setup("[[fault]]\nat_s = 0\nwhat = \"" + std::string(what) + "\"\n"), log());
    marks_.reach(Milestone::kStart, 1);
    control.look(marks_, 2);
  };
  EXPECT_EXIT(die("process.abort"), ::testing::KilledBySignal(SIGABRT), "");
  EXPECT_EXIT(die("process.segv"), ::testing::KilledBySignal(SIGSEGV), "");
}

}  // namespace
}  // namespace wasp::scheduling
