#include "hm/odometry/registration/relocalisation.hpp"

#include <gtest/gtest.h>

#include <set>

namespace hm {
namespace {

Time at(double s) { return Time::from_seconds(s); }

/// Time until all places have been compared.
double search_time_s(double period_s, std::size_t places) {
  LostState state;
  std::set<std::size_t> compared;
  for (int frame = 1; frame < 1000; ++frame) {
    const Time stamp = at(10 + frame * period_s);
    const RelocalisationSearch search = state.next_search(stamp, at(10), 15);
    for (std::size_t i = 0; i < search.count; ++i) compared.insert((search.first + i) % places);
    state.count(stamp);
    if (compared.size() == places) return state.duration_s() + period_s;
  }
  return 1e9;
}

TEST(LostState, AllPlacesAreComparedInTheSameTimeAtAnyRate) {
  EXPECT_NEAR(search_time_s(1.0 / 30, 60), 0.5, 1e-6);
  EXPECT_LE(search_time_s(1.0 / 15, 60), 0.55);
  EXPECT_LE(search_time_s(1.0 / 5, 60), 0.61);
}

TEST(LostState, CountsFramesAndTimeAndForgetsThemWhenFound) {
  LostState state;
  EXPECT_FALSE(state.lost());
  EXPECT_EQ(state.duration_s(), 0);
  for (int i = 0; i < 4; ++i) state.count(at(3 + 0.2 * i));
  EXPECT_TRUE(state.lost());
  EXPECT_EQ(state.frames(), 4);
  EXPECT_NEAR(state.duration_s(), 0.6, 1e-9);
  state.found();
  EXPECT_FALSE(state.lost());
  EXPECT_EQ(state.next_search(at(4), at(4 - 1.0 / 30), 15).first, 0u);
}

TEST(Relocalisation, FindsNothingWithoutPlacesOrFeatures) {
  int matches = -1;
  EXPECT_FALSE(find_again({}, {}, {}, matches));
  EXPECT_EQ(matches, 0);
  const FeatureSet none;
  const KnownPlace place{&none, {}, 1};
  EXPECT_FALSE(find_again({&place, 1}, none, {}, matches));
}

}  // namespace
}  // namespace hm
