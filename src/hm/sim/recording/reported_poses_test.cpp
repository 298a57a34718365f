#include "hm/sim/recording/reported_poses.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "hm/core/statistics.hpp"
#include "hm/sim/motion/walk.hpp"
#include "hm/sim/office/wheel_errors.hpp"

namespace hm {
namespace {

double heading_rad(const SE3& pose) { return std::atan2(pose.rotation()(1, 2), pose.rotation()(0, 2)); }

double turned_rad(const SE3& from, const SE3& to) {
  return std::remainder(heading_rad(to) - heading_rad(from), 2 * std::numbers::pi);
}

TEST(ReportedPoses, OfWheelsErrAsThoseOfTheRealRobot) {
  const Walk walk = corridor_walk();
  std::vector<SE3> truth;
  for (double t = 0; t < walk.duration_s(); t += 0.2) truth.push_back(walk.T_world_camera(t));
  constexpr std::size_t kWindow = 6;  // about a metre
  std::vector<double> long_ratios, veers_rad_m;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const std::vector<SE3> reported = poses_of_wheels(truth, seed);
    ASSERT_EQ(reported.size(), truth.size());
    EXPECT_EQ(reported.front().matrix(), truth.front().matrix());
    double veer_rad = 0, way_m = 0, reported_m = 0;
    for (std::size_t i = kWindow; i < truth.size(); i += kWindow) {
      ASSERT_EQ(reported[i].translation().z(), truth[i].translation().z());
      ASSERT_NEAR(reported[i].rotation()(2, 2), truth[i].rotation()(2, 2), 1e-9);  // pitch is right
      const double turn_rad = turned_rad(truth[i - kWindow], truth[i]);
      if (std::abs(turn_rad) > 0.01) continue;
      way_m += (truth[i].translation() - truth[i - kWindow].translation()).norm();
      reported_m += (reported[i].translation() - reported[i - kWindow].translation()).norm();
      veer_rad += turned_rad(reported[i - kWindow], reported[i]) - turn_rad;
    }
    ASSERT_GT(way_m, 30);
    long_ratios.push_back(reported_m / way_m - 1);
    veers_rad_m.push_back(std::abs(veer_rad / way_m));
  }
  EXPECT_NEAR(summarise(long_ratios).mean, WheelErrors::kLongRatio, 0.005);
  EXPECT_NEAR(summarise(veers_rad_m).mean, WheelErrors::kVeer_rad_m, 0.005);
  EXPECT_NE(poses_of_wheels(truth, 1)[50].matrix(), poses_of_wheels(truth, 2)[50].matrix());
}

}  // namespace
}  // namespace hm
