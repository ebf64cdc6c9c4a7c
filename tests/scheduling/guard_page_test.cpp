// The page between guardian and flight: sealed, inherited, refused when it is something else.
#include "scheduling/guard_page.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

namespace wasp::scheduling {
namespace {

TEST(GuardPage, BothSidesSeeTheSameWords) {
  const GuardPage made = GuardPage::create();
  const GuardPage adopted = GuardPage::adopt(dup(made.fd()));
  adopted.block().beat_at_ns.store(123);
  made.block().owner.store(static_cast<std::uint32_t>(LineOwner::kGuardian));
  EXPECT_EQ(made.block().beat_at_ns.load(), 123);
  EXPECT_EQ(adopted.block().owner.load(), static_cast<std::uint32_t>(LineOwner::kGuardian));
  EXPECT_EQ(adopted.fd(), -1);
}

TEST(GuardPage, CannotBeTruncatedUnderWhoeverMapsIt) {
  const GuardPage page = GuardPage::create();
  EXPECT_NE(ftruncate(page.fd(), 0), 0);
  EXPECT_NE(ftruncate(page.fd(), 8192), 0);
}

TEST(GuardPage, RefusesWhatIsNotASealedPage) {
  EXPECT_THROW(GuardPage::adopt(-1), std::runtime_error);
  EXPECT_THROW(GuardPage::adopt(open("/dev/null", O_RDWR | O_CLOEXEC)), std::runtime_error);
  const int unsealed = memfd_create("unsealed", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  ASSERT_EQ(ftruncate(unsealed, 4096), 0);
  EXPECT_THROW(GuardPage::adopt(unsealed), std::runtime_error);
  const int sealed = memfd_create("of something else", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  ASSERT_EQ(ftruncate(sealed, 4096), 0);
  ASSERT_EQ(fcntl(sealed, F_ADD_SEALS, F_SEAL_SHRINK), 0);
  EXPECT_THROW(GuardPage::adopt(sealed), std::runtime_error);
}

}  // namespace
}  // namespace wasp::scheduling
