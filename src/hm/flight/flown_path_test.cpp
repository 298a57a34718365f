#include "hm/flight/flown_path.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

/// Distance of a position from the recorded path.
float off_path_m(const FlownPath& path, const Vec3f& position) {
  float least = norm_f(Vec3f(position - path.point(0)));
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Vec3f a = path.point(i - 1), along = path.point(i) - a;
    const float share = std::clamp((position - a).dot(along) / along.squaredNorm(), 0.0F, 1.0F);
    least = std::min(least, (position - a - share * along).norm());
  }
  return least;
}

TEST(FlownPath, KeepsAPointEachHalfMetre) {
  FlownPath path;
  path.start({0, 0, 1});
  for (int i = 0; i <= 500; ++i) path.record({0.01F * static_cast<float>(i), 0, 1});
  EXPECT_GE(path.size(), 10u);
  EXPECT_LE(path.size(), 11u);
  EXPECT_NEAR(path.length_m({5, 0, 1}), 5, 0.01F);
}

TEST(FlownPath, CutsLoopsOff) {
  FlownPath path;
  path.start({0, 0, 1});
  const auto fly = [&](Vec3f from, Vec3f to) {
    for (int i = 0; i <= 100; ++i) path.record(from + 0.01F * static_cast<float>(i) * (to - from));
  };
  fly({0, 0, 1}, {5, 0, 1});
  fly({5, 0, 1}, {5, 5, 1});
  fly({5, 5, 1}, {2, 5, 1});
  EXPECT_GT(path.length_m({2, 5, 1}), 12.5F);
  fly({2, 5, 1}, {2, 0, 1});  // back on the way out
  EXPECT_LT(path.length_m({2, 0, 1}), 2.6F);
}

TEST(FlownPath, StaysBoundedAndNearTheTrueWay) {
  FlownPath path;
  path.start({0, 0, 1});
  std::vector<Vec3f> flown;
  for (int i = 0; i < 20000; ++i) {  // corridors of 3 m, each beside the last: 64 points for 200 m
    const float t = 0.01F * static_cast<float>(i), along = std::fmod(t, 10.0F);
    const int lane = static_cast<int>(t / 10);
    const Vec3f position(lane % 2 == 0 ? along : 10 - along, 2.0F * static_cast<float>(lane), 1);
    flown.push_back(position);
    path.record(position);
    ASSERT_LE(path.size(), FlownPath::kCapacity);
  }
  EXPECT_EQ(path.point(0), Vec3f(0, 0, 1));
  float worst = 0;
  for (std::size_t i = 0; i < flown.size(); i += 50) worst = std::max(worst, off_path_m(path, flown[i]));
  EXPECT_LT(worst, 0.6F);  // dropping every second point would cut corners by metres
}

TEST(FlownPath, LeadsHomePointByPoint) {
  FlownPath path;
  path.start({0, 0, 1});
  path.record({1, 0, 1});
  path.record({1, 1, 1});
  EXPECT_EQ(path.last(), Vec3f(1, 1, 1));
  path.drop_last();
  EXPECT_EQ(path.last(), Vec3f(1, 0, 1));
  path.drop_last();
  path.drop_last();
  EXPECT_EQ(path.last(), Vec3f(0, 0, 1));  // home stays
  EXPECT_EQ(path.size(), 1u);
}

}  // namespace
}  // namespace hm
