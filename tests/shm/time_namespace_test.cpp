#include "shm/time_namespace.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <fstream>

#include "tests/support/child.h"

namespace wasp::shm {
namespace {

/// A process whose clock is an hour ahead; -1 where the kernel or our rights have no time namespaces.
class AnHourAhead {
 public:
  AnHourAhead() {
    int line[2];
    if (pipe(line) != 0) return;
    maker_ = test::start_child([&] {
      pid_t pid = -1;
      if (unshare(CLONE_NEWTIME) == 0 && (std::ofstream("/proc/self/timens_offsets") << "monotonic 3600 0\n").flush())
        pid = test::start_child([] { return pause(); });
      static_cast<void>(!write(line[1], &pid, sizeof pid));
      return pause();
    });
    static_cast<void>(!read(line[0], &pid_, sizeof pid_));
    close(line[0]);
    close(line[1]);
  }
  ~AnHourAhead() { test::kill_and_wait(maker_); }  // its child dies with it
  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] pid_t maker() const { return maker_; }

 private:
  pid_t maker_ = -1, pid_ = -1;
};

TEST(TimeNamespace, AProcessOfAnotherClockIsNamedWithTheDifference) {
  const AnHourAhead other;
  if (other.pid() <= 0) GTEST_SKIP() << "no right to make a time namespace";
  const std::string why = foreign_clock(other.pid());
  EXPECT_NE(why.find(std::to_string(other.pid())), std::string::npos) << why;
  EXPECT_NE(why.find("time namespace"), std::string::npos) << why;
  EXPECT_NE(why.find("3600 s ahead"), std::string::npos) << why;
}

TEST(TimeNamespace, OursIsNoStrangerNorIsWhoMadeAnother) {
  EXPECT_EQ(foreign_clock(getpid()), "");
  EXPECT_EQ(foreign_clock(getppid()), "");
  const AnHourAhead other;
  if (other.pid() <= 0) GTEST_SKIP() << "no right to make a time namespace";
  EXPECT_EQ(foreign_clock(other.maker()), "") << "its children live there, not itself";
}

TEST(TimeNamespace, NobodyCanTellOfAProcessThatIsGone) {
  const pid_t gone = test::start_child([] { return 0; });
  test::wait_for(gone);
  EXPECT_EQ(foreign_clock(gone), "");
}

}  // namespace
}  // namespace wasp::shm
