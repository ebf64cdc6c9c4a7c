// A writer killed at every step it takes: after each single instruction (ptrace) of a run of messages that laps the
// ring, and at every system call of Region::create and at instructions between them, whether it makes the region, takes
// it over, or puts another in its place. After each death whoever looks finds a valid region or a clear refusal, and a
// successor goes on. WASP_STEPPING=n tries n times as many instructions within create (default 1).
#include <cstdlib>
#include <random>

#include "tests/shm/fixture.h"
#include "tests/support/traced.h"

namespace wasp::shm {
namespace {

/// Small, so that one message is a hundred instructions or so.
using Small = std::array<std::uint64_t, 8>;
constexpr std::uint32_t kSlots = 3;

#if defined(__SANITIZE_THREAD__)
constexpr std::uint64_t kStride = 601;  // tens of thousands of instructions
#elif defined(__SANITIZE_ADDRESS__)
constexpr std::uint64_t kStride = 31;
#else
constexpr std::uint64_t kStride = 1;
#endif

/// Publishes the next message in place.
void publish_next(RingWriter& writer) {
  const std::uint64_t n = writer.published() + 1;
  auto* words = reinterpret_cast<std::uint64_t*>(writer.loan());
  for (std::size_t i = 0; i < std::tuple_size_v<Small>; ++i) words[i] = n * 0x9E3779B97F4A7C15ull + i;
  writer.publish(static_cast<TimeNs>(n));
}
bool is_message(const Small& value, std::uint64_t n) {
  for (std::size_t i = 0; i < value.size(); ++i)
    if (value[i] != n * 0x9E3779B97F4A7C15ull + i) return false;
  return true;
}

class Stepping : public NamedRegion {
 protected:
  Region create(std::uint32_t slots = kSlots) { return Region::create(name_, one_ring(slots, sizeof(Small))); }

  /// What must hold after any death: the newest messages are there and whole. Nothing lies under the slot that the dead
  /// may have begun, so all but one.
  void expect_history(const Region& region, std::uint64_t at_least, const std::string& where) {
    const RingReader reader(region, "data");
    const std::uint64_t newest = reader.newest();
    ASSERT_GE(newest, at_least) << where;
    for (std::uint64_t n = newest; n > 0 && n + kSlots - 1 > newest; --n) {
      Small value{};
      ASSERT_TRUE(reader.copy(n, value)) << where << ": message " << n << " of " << newest << " is gone";
      ASSERT_TRUE(is_message(value, n)) << where << ": message " << n;
    }
  }
  /// A new writer goes on behind the newest message; a reader that was there all along hears it.
  void expect_successor(const std::string& where) {
    const Region region = create();
    RingWriter writer(region, "data");
    const std::uint64_t before = writer.published();
    ASSERT_NO_FATAL_FAILURE(expect_history(region, before, where));
    RingReader reader(region, "data");
    for (std::uint64_t n = before + 1; n <= before + 2; ++n) {
      publish_next(writer);
      Small value{};
      ASSERT_TRUE(reader.read(value) && is_message(value, n)) << where << ": the successor's message " << n;
    }
  }
};

TEST_F(Stepping, WriterKilledAfterEachInstructionOfMessagesThatLapTheRing) {
  constexpr std::uint64_t kMessages = 2 * kSlots + 1;
  { const Region region = create(); }
  const Region region = Region::attach(name_);
  RingReader witness(region, "data");
  std::uint64_t steps = 0, deaths = 0;
  for (bool finished = false; !finished; steps += kStride, ++deaths) {
    const std::uint64_t before = witness.newest();
    {
      test::Traced writer([&] { return create(); },
                          [](const Region& own) {
                            RingWriter ring(own, "data");
                            for (std::uint64_t i = 0; i < kMessages; ++i) publish_next(ring);
                          });
      if (!writer.permitted()) GTEST_SKIP() << "ptrace is not permitted here";
      writer.step_instructions(steps);
      finished = writer.finished();
    }
    const std::string where = "killed after instruction " + std::to_string(steps);
    ASSERT_LE(witness.newest(), before + kMessages) << where;
    ASSERT_NO_FATAL_FAILURE(expect_history(region, before, where));
    ASSERT_NO_FATAL_FAILURE(expect_history(Region::attach(name_), before, where));
    ASSERT_NO_FATAL_FAILURE(expect_successor(where));
    for (Small value{}; const Sample sample = witness.next();)
      ASSERT_TRUE(!witness.copy(sample.number, value) || is_message(value, sample.number)) << where;
    ASSERT_LT(steps, 2'000'000u);
  }
  EXPECT_GT(deaths, 100u);
  std::printf("writer killed after each of %llu instructions\n", static_cast<unsigned long long>(deaths));
  RecordProperty("deaths", std::to_string(deaths));
}

/// What lies there before the create that is killed.
struct Before {
  const char* what;
  std::uint32_t slots;     ///< of the ring that is already there; 0: nothing is
  std::uint64_t messages;  ///< in it, which must outlive the death
};

class SteppingThroughCreate : public Stepping, public testing::WithParamInterface<Before> {
 protected:
  void prepare() {
    Region::remove(name_);
    if (GetParam().slots == 0) return;
    const Region region = create(GetParam().slots);
    RingWriter writer(region, "data");
    for (int i = 0; i < 5; ++i) publish_next(writer);
  }

  /// Kills a create after so many system call stops and instructions; false if it was through before that.
  bool kill_create(std::uint64_t system_calls, std::uint64_t instructions) {
    prepare();
    bool finished = false;
    {
      test::Traced writer([] { return 0; }, [&](int) { create(); });
      if (!writer.permitted()) return permitted_ = false;
      writer.step_system_calls(system_calls);
      writer.step_instructions(instructions);
      finished = writer.finished();
    }
    ++deaths_;
    const std::string where = "killed after system call stop " + std::to_string(system_calls) + " and " +
                              std::to_string(instructions) + " instructions";
    expect_valid_or_refused(where);
    if (!HasFatalFailure()) expect_history(create(), GetParam().messages, where);
    if (!HasFatalFailure()) expect_successor(where);
    return !finished;
  }
  /// An observer gets a region that is whole, or a refusal that names it.
  void expect_valid_or_refused(const std::string& where) {
    const std::string refusal = error_of([&] {
      const Region region = Region::attach(name_);
      RingReader reader(region, "data");
      reader.rewind();
      while (reader.next()) {
      }
    });
    ASSERT_TRUE(refusal.empty() || refusal.find(name_) != std::string::npos) << where << ": " << refusal;
  }

  bool permitted_ = true;
  std::uint64_t deaths_ = 0;
};

TEST_P(SteppingThroughCreate, KilledAtEverySystemCallAndBetweenThemLeavesAValidRegion) {
  const char* more = std::getenv("WASP_STEPPING");
  const int instructions = more != nullptr ? std::atoi(more) : 1;
  std::mt19937 random(7);
  std::uniform_int_distribution<std::uint64_t> next_few(1, 400);
  for (std::uint64_t stop = 0; kill_create(stop, 0); ++stop) {
    if (HasFatalFailure()) return;
    for (int i = 0; i < 4 * instructions; ++i) {
      kill_create(stop, next_few(random));
      if (HasFatalFailure()) return;
    }
    ASSERT_LT(stop, 10'000u);
  }
  if (!permitted_) GTEST_SKIP() << "ptrace is not permitted here";
  EXPECT_GT(deaths_, 50u);
  std::printf("%s: killed %llu times\n", GetParam().what, static_cast<unsigned long long>(deaths_));
  RecordProperty("deaths", std::to_string(deaths_));
}

INSTANTIATE_TEST_SUITE_P(Found, SteppingThroughCreate,
                         testing::Values(Before{"nothing", 0, 0}, Before{"the_same", kSlots, 5},
                                         Before{"another_layout", kSlots + 1, 0}),
                         [](const auto& found) { return std::string(found.param.what); });

}  // namespace
}  // namespace wasp::shm
