#include "hm/slam/laser/live_laser_loop_closer.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "hm/slam/laser/testing/drifting_drive.hpp"

namespace hm {
namespace {

using namespace laser_testing;

struct OdometryOfScan {
  PlanarScan scan;
  OdometryStep step;
};

/// Once around an office's corridor and on, by an odometry that drifts.
std::vector<OdometryOfScan> drifting_drive() {
  std::vector<OdometryOfScan> result;
  for (GraphKeyframe2D& keyframe : drive(office_world(), two_rounds(), {181, 4.71, 30, 0.01}).keyframes) {
    OdometryOfScan next{std::move(keyframe.scan), {}};
    next.step.status = OdometryStatus::kTracking;
    next.step.T_odom_base = keyframe.T_odom_base;
    next.step.T_keyframe_base = SE2();
    next.step.new_keyframe = true;
    next.step.match.covariance = keyframe.covariance;
    result.push_back(std::move(next));
  }
  return result;
}

TEST(LiveLaserLoopCloser, GivesTheSameBitsOnAThreadOfItsOwn) {
  LaserLoopCloser plain;
  LiveLaserLoopCloser caller({}, LoopThread::kCaller), own({}, LoopThread::kOwn);
  for (const OdometryOfScan& next : drifting_drive()) {
    plain.add(next.scan, next.step);
    caller.add(next.scan, next.step);
    own.add(next.scan, next.step);
    ASSERT_EQ(caller.T_map_odom().vector(), plain.T_map_odom().vector());
    EXPECT_EQ(caller.waiting_keyframes(), 0u);
  }
  EXPECT_EQ(own.settled().T_map_odom().vector(), plain.T_map_odom().vector());
  EXPECT_EQ(own.T_map_odom().vector(), plain.T_map_odom().vector());
  EXPECT_EQ(own.waiting_keyframes(), 0u);
  plain.finish();
  caller.finish();
  own.finish();
  ASSERT_GT(plain.graph().statistics().accepted, 0u);
  const auto& wanted = plain.graph().graph().T_map_node;
  for (const LaserLoopCloser* closer : {&caller.settled(), &own.settled()}) {
    const auto& nodes = closer->graph().graph().T_map_node;
    ASSERT_EQ(nodes.size(), wanted.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) ASSERT_EQ(nodes[i].vector(), wanted[i].vector()) << i;
  }
}

TEST(LiveLaserLoopCloser, EndsWhileScansWait) {
  const auto drive = drifting_drive();
  LiveLaserLoopCloser live({}, LoopThread::kOwn);
  for (const OdometryOfScan& next : drive) live.add(next.scan, next.step);
  // Its end drops those that wait, and waits for the one that is processed.
}

}  // namespace
}  // namespace hm
