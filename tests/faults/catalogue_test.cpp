// The catalogue itself: complete, and every row one that can be done.
#include "faults/catalogue.h"

#include <gtest/gtest.h>

#include <set>

#include "faults/campaign.h"
#include "scheduling/fault_points.h"

namespace wasp::faults {
namespace {

TEST(Catalogue, HasAtLeastNinetyDistinctFaultsInAllClasses) {
  std::set<std::string_view> ids;
  std::set<int> classes;
  for (const Fault& f : catalogue()) {
    EXPECT_TRUE(ids.insert(f.id).second) << f.id << " twice";
    classes.insert(f.class_number);
  }
  EXPECT_GE(ids.size(), 90u);
  for (int c = 1; c <= 18; ++c) EXPECT_TRUE(classes.contains(c)) << "class " << c;
}

TEST(Catalogue, EveryFaultPointOfTheFlightIsUsedAndEveryOneUsedExists) {
  std::set<std::string_view> used;
  for (const Fault& f : catalogue())
    if (f.injector == Injector::kPoint) {
      used.insert(f.what);
      EXPECT_TRUE(scheduling::fault_point_named(f.what)) << f.what;
    }
  for (std::size_t i = 0; i < scheduling::kFaultPoints; ++i)
    EXPECT_TRUE(used.contains(scheduling::name_of(static_cast<scheduling::FaultPoint>(i))))
        << scheduling::name_of(static_cast<scheduling::FaultPoint>(i));
}

TEST(Catalogue, PromisesAreWholeAndPhasesNotEmpty) {
  for (const Fault& f : catalogue()) {
    if (f.promise == Promise::kNeutral) {
      EXPECT_GT(f.detected_ms, 0) << f.id;
      EXPECT_GT(f.response_ms, 0) << f.id;
      EXPECT_TRUE(f.recovered_ms > 0 || f.isolated) << f.id << ": what it shares a flight with would never be flown";
    }
    if (f.promise == Promise::kGuardian || f.promise == Promise::kReported) {
      EXPECT_GT(f.detected_ms, 0) << f.id;
    }
    if (f.injector == Injector::kStart) {
      EXPECT_EQ(f.promise, Promise::kRefused) << f.id;
      EXPECT_FALSE(f.says.empty()) << f.id;
    }
    EXPECT_NE(f.phases, 0u) << f.id;
    EXPECT_LE(f.for_s, 5) << f.id;
  }
}

TEST(Catalogue, TheShortSetIsADozenAndSelectionSelects) {
  CampaignOptions o;
  o.short_set = true;
  const auto cells = select_cells(o);
  EXPECT_GE(cells.size(), 10u);
  EXPECT_LE(cells.size(), 14u);
  std::set<int> classes;
  for (const Cell& c : cells) classes.insert(c.fault->class_number);
  EXPECT_GE(classes.size(), 7u);
  CampaignOptions one;
  one.only = "^line-silence$", one.phase = Phase::kCruise, one.seeds = 3;
  EXPECT_EQ(select_cells(one).size(), 3u);
}

}  // namespace
}  // namespace wasp::faults
