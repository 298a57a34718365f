#include "hm/flight/touchdown_detector.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <vector>

namespace hm {
namespace {

GroundSigns on_the_ground() { return {-0.4F, -0.02F, 0.5F, 0, 0.05F}; }

/// Milliseconds until the touch-down is found; -1 within 2 s.
int found_after_ms(TouchdownDetector& detector, const GroundSigns& signs, int from_ms = 0) {
  for (int t = 0; t < 2000; ++t)
    if (detector.step(Time{std::int64_t{1'000'000} * (from_ms + t)}, signs)) return t;
  return -1;
}

TEST(TouchdownDetector, FindsTheGroundAfter350Milliseconds) {
  TouchdownDetector detector;
  EXPECT_NEAR(found_after_ms(detector, on_the_ground()), 350, 1);
  detector.reset();
  GroundSigns blind = on_the_ground();
  blind.clearance_m.reset();
  EXPECT_NEAR(found_after_ms(detector, blind, 5000), 350, 1);
}

TEST(TouchdownDetector, EachSignCanRuleItOut) {
  const std::vector<std::function<void(GroundSigns&)>> in_the_air{
      [](GroundSigns& s) { s.wanted_climb_m_s = 0; },      // hovers on purpose
      [](GroundSigns& s) { s.climb_m_s = -0.11F; },        // sinks
      [](GroundSigns& s) { s.climb_m_s = 0.11F; },         // a gust lifts it
      [](GroundSigns& s) { s.thrust_per_hover = 0.61F; },  // the rotors carry it
      [](GroundSigns& s) { s.clearance_m = 0.16F; },       // the ground is away
      [](GroundSigns& s) { s.climb_m_s = std::numeric_limits<float>::quiet_NaN(); },
      [](GroundSigns& s) { s.thrust_per_hover = std::numeric_limits<float>::quiet_NaN(); }};
  for (const auto& change : in_the_air) {
    TouchdownDetector detector;
    GroundSigns signs = on_the_ground();
    change(signs);
    EXPECT_EQ(found_after_ms(detector, signs), -1);
  }
}

TEST(TouchdownDetector, FeetThatAreSeenDownNeedLessOfTheThrustGone) {
  GroundSigns weak_battery = on_the_ground();
  weak_battery.thrust_per_hover = 0.8F;
  TouchdownDetector detector;
  EXPECT_EQ(found_after_ms(detector, weak_battery), -1);
  weak_battery.clearance_m = 0.01F;
  EXPECT_NEAR(found_after_ms(detector, weak_battery, 5000), 350, 1);
  detector.reset();
  weak_battery.thrust_per_hover = 1.1F;  // brakes above the ground
  EXPECT_EQ(found_after_ms(detector, weak_battery, 9000), -1);
}

TEST(TouchdownDetector, WhatCarriesBesidesTheRotorsIsTheGroundWhateverTheSpeedSeems) {
  GroundSigns drifted = on_the_ground();
  drifted.climb_m_s = -0.3F;
  drifted.thrust_per_hover = 0.8F;
  drifted.clearance_m.reset();
  TouchdownDetector detector;
  EXPECT_EQ(found_after_ms(detector, drifted), -1);
  drifted.carried_m_s2 = 0.2F * 9.81F;
  EXPECT_NEAR(found_after_ms(detector, drifted, 5000), 350, 1);
  drifted.clearance_m = 0.5F;  // a gust from below
  detector.reset();
  EXPECT_EQ(found_after_ms(detector, drifted, 9000), -1);
}

TEST(TouchdownDetector, AVehicleThatStandsOnATableIsFoundThoughTheFloorIsSeen) {
  GroundSigns on_a_table = on_the_ground();
  on_a_table.clearance_m = 0.6F;
  TouchdownDetector detector;
  EXPECT_EQ(found_after_ms(detector, on_a_table), -1);
  EXPECT_TRUE(detector.step(Time{TouchdownDetector::kUnseen.ns}, on_a_table));
}

TEST(TouchdownDetector, ABounceStartsItAnew) {
  TouchdownDetector detector;
  for (int t = 0; t < 300; ++t)
    ASSERT_FALSE(detector.step(Time{std::int64_t{1'000'000} * t}, on_the_ground()));
  GroundSigns bounce = on_the_ground();
  bounce.climb_m_s = 0.3F;
  EXPECT_FALSE(detector.step(Time{300'000'000}, bounce));
  EXPECT_NEAR(found_after_ms(detector, on_the_ground(), 301), 350, 1);
}

}  // namespace
}  // namespace hm
