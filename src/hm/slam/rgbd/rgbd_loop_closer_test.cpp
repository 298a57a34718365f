#include "hm/slam/rgbd/rgbd_loop_closer.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/slam/rgbd/live_rgbd_loop_closer.hpp"
#include "hm/slam/rgbd/testing/landmark_world.hpp"

namespace hm {
namespace {

using test::landmark_camera;

/// Root mean square distance of keyframes from the truth; the first is where it should be.
double error_m(const CorrectedKeyframes& corrected, const std::vector<SE3>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    sum += (corrected.keyframes()[i].T_map_camera.translation() - truth[i].translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

double odometry_error_m(const test::KeyframesOfWay& way) {
  double sum = 0;
  for (std::size_t i = 0; i < way.truth.size(); ++i)
    sum += (way.keyframes[i]->T_odom_camera.translation() - way.truth[i].translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(way.truth.size()));
}

/// Twice around a ring of 40 m with a yaw drift of 3 mrad/m: odometry is metres off, the corrected map
/// centimetres.
TEST(RgbdLoopCloser, RingIsClosed) {
  Rng rng(1);
  const test::LandmarkWorld world = test::ring(10, 100, rng);
  const test::KeyframesOfWay way = test::walk(world, test::way_around(10, 0.4, 1.6), 0.003, rng);
  RgbdLoopCloser closer(landmark_camera());
  for (const auto& keyframe : way.keyframes) closer.add(keyframe);
  const double solved_m = error_m(closer.corrected(), way.truth);
  const RgbdAlignmentReport report = closer.finish();
  const RgbdLoopStatistics loops = closer.statistics();
  EXPECT_GT(odometry_error_m(way), 0.4);
  EXPECT_GT(loops.accepted, 20U);
  EXPECT_EQ(loops.candidates, loops.accepted + loops.waiting + loops.not_verified + loops.too_far +
                                  loops.ambiguous + loops.unconfirmed);
  const double final_m = error_m(closer.corrected(), way.truth);
  EXPECT_LT(solved_m, 0.02);
  EXPECT_LT(final_m, 0.02);
  EXPECT_EQ(loops.maps, 1U);
  EXPECT_TRUE(report.adjusted);
  EXPECT_GT(report.landmarks, 1000U);
}

}  // namespace
}  // namespace hm
