#include "hm/pipeline/flight/onboard_computer.hpp"

#include <gtest/gtest.h>

#include "hm/pipeline/flight/flight_test_support.hpp"

namespace hm {
namespace {

struct PosesOnBoard : FlightObserver {
  void on_pose(const Received<PoseMessage>& pose) override { all.push_back(pose); }
  /// Counter of restarts of the last pose that arrived before a time.
  [[nodiscard]] int restarts_before(Time end) const {
    int restarts = -1;
    for (const auto& pose : all)
      if (pose.at < end) restarts = pose.measured.restarts;
    return restarts;
  }
  std::vector<Received<PoseMessage>> all;
};

TEST(OnboardComputer, PosesCountHowOftenTrackingWasLost) {
  PosesOnBoard poses;
  test::ScriptedFlight flight({}, "fault sensor_turned at 2 for 3", &poses);
  const Time start = flight.run.now();
  flight.run_s(8);
  EXPECT_EQ(poses.restarts_before(start + Duration::from_seconds(2)), 0);
  const int turned = poses.restarts_before(start + Duration::from_seconds(5));
  const int back = poses.restarts_before(start + Duration::from_seconds(8));
  EXPECT_GE(turned, 1) << "on the ground poses go on";
  EXPECT_GT(back, turned);
  EXPECT_LT(back, 10) << "not at every scan";
  for (std::size_t i = 1; i < poses.all.size(); ++i) {
    const PoseMessage &before = poses.all[i - 1].measured, &now = poses.all[i].measured;
    const float jump_rad = std::abs(wrap_angle_f(now.pose.x_y_yaw[2] - before.pose.x_y_yaw[2]));
    if (now.restarts == before.restarts) {
      EXPECT_LT(jump_rad, 0.1F) << i;
    }
  }
}

}  // namespace
}  // namespace hm
