#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "hm/odometry/testing/textured_room.hpp"
#include "hm/odometry/tracker.hpp"

namespace hm {
namespace {

/// Over many worlds and noises the errors must be as large as the covariances say: the mean of the squared
/// Mahalanobis distance is 6 for six degrees of freedom.
TEST(TrackerCovariance, IsHonestOverSeeds) {
  double sum = 0, worst = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    Rng rng(seed);
    TexturedRoom room;
    room.seed = static_cast<std::uint32_t>(100 * seed);
    const SE3 start(so3_exp(Vec3(0, 0.26 * static_cast<double>(seed), 0)), Vec3::Zero());
    const auto odometry = make_tracker({}, room_camera(), start * path_pose(0));
    for (int i = 0; i < 12; ++i) {
      const SE3 truth = start * path_pose(i * 0.1);
      const RgbdFrame frame =
          render_room(room, room_camera(), truth, Time::from_seconds(1 + i * 0.1), {true, 2.0, {}}, &rng);
      const TrackedFrame tracked = odometry->track(frame);
      ASSERT_TRUE(tracked.T_odom_camera) << tracked.reason;
      if (i < 4 || i % 4 != 3) continue;
      // exp(xi) T = truth
      const Vec6 error = (truth * tracked.T_odom_camera->inverse()).log();
      const double nees = error.dot(tracked.covariance.ldlt().solve(error));
      sum += nees;
      worst = std::max(worst, nees);
      ++count;
    }
  }
  RecordProperty("mean_nees", std::to_string(sum / count));
  EXPECT_LT(sum / count, 12) << "promises too much";
  EXPECT_GT(sum / count, 2) << "promises too little";
  EXPECT_LT(worst, 60);
}

TEST(TrackerCovariance, GrowsAlongThePathAndIsSymmetric) {
  const auto odometry = make_tracker({}, room_camera(), path_pose(0));
  double first = 0, last = 0;
  for (int i = 0; i < 60; ++i) {
    const TrackedFrame tracked =
        odometry->track(render_room({}, room_camera(), path_pose(i * 0.1), Time::from_seconds(1 + i * 0.1)));
    ASSERT_TRUE(tracked.T_odom_camera) << tracked.reason;
    EXPECT_LT((tracked.covariance - tracked.covariance.transpose()).norm(),
              1e-9 * (1e-9 + tracked.covariance.norm()));
    if (i == 1) first = tracked.covariance.trace();
    last = tracked.covariance.trace();
  }
  EXPECT_GT(first, 0);
  EXPECT_GT(last, first);
}

}  // namespace
}  // namespace hm
