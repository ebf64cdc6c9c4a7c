// Runs a check once on every instruction set this machine has and the vision library was built for, down to the
// fallback in plain C++: what run-time dispatch would choose on other machines.
#pragma once

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <string>

namespace wasp::vision::test {

/// `check(name)` for each; dispatch is back to normal afterwards.
template <class Check>
void on_every_target(const Check& check) {
  const auto run = [&check](std::int64_t target, const std::string& name) {
    SCOPED_TRACE(name);
    hwy::GetChosenTarget().Update(target);
    check(name);
  };
  std::int64_t rest = hwy::SupportedTargets() & HWY_TARGETS & ~(HWY_SCALAR | HWY_EMU128);
  for (; rest != 0; rest &= rest - 1) run(rest & -rest, hwy::TargetName(rest & -rest));
  run(0, "fallback");
  hwy::GetChosenTarget().DeInit();
}

}  // namespace wasp::vision::test
