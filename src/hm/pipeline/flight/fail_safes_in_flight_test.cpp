// Every fail-safe of the table in closed loop: it acts within a step of its time-out, and the flight ends as
// it should.
#include <gtest/gtest.h>

#include <set>

#include "hm/core/parallel.hpp"
#include "hm/flight/flight_text.hpp"
#include "hm/pipeline/flight/flight_test_support.hpp"
#include "hm/pipeline/flight/testing/fail_safe_provocation.hpp"

namespace hm {
namespace {

TEST(FailSafesInFlight, EachActsAfterItsTimeOut) {
  const std::vector<Provocation> all = fail_safe_provocations();
  std::set<FailSafe> judged;
  for (const Provocation& provocation : all)
    judged.insert(provocation.judged.begin(), provocation.judged.end());
  EXPECT_EQ(judged.size(), kFailSafeCount);
  std::vector<ProvocationOutcome> outcomes(all.size());
  ParallelLoop(2).for_ranges(all.size(), 1, [&](std::size_t i, std::size_t) {
    outcomes[i] = provoke(test::house_site(), all[i], 1);
  });
  for (std::size_t i = 0; i < all.size(); ++i) {
    const ProvocationOutcome& outcome = outcomes[i];
    ASSERT_EQ(outcome.off_steps.size(), all[i].judged.size());
    for (std::size_t k = 0; k < outcome.off_steps.size(); ++k)
      EXPECT_LE(outcome.off_steps[k], 1.0 + 1e-6) << all[i].name << ": " << text_of(all[i].judged[k]);
    EXPECT_TRUE(outcome.ended_well) << all[i].name;
    if (stays_whole(all[i].end)) {
      EXPECT_EQ(outcome.collisions, 0u) << all[i].name;
    }
  }
}

TEST(FailSafesInFlight, ATurnedSensorIsSaidWithItsAngle) {
  AutopilotOutputs outputs;
  outputs.tilt_mismatch_rad = 1.5708F;
  EXPECT_EQ(fail_safe_text(FailSafe::kTiltMismatch, outputs),
            "tilt and motion disagree: the position sensor is turned by 90 degrees");
  EXPECT_EQ(fail_safe_text(FailSafe::kPoseLost, outputs), "position lost");
}

}  // namespace
}  // namespace hm
