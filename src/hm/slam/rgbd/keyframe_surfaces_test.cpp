#include "hm/slam/rgbd/keyframe_surfaces.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stop_token>

#include "hm/core/testing/drawn_vector.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/slam/rgbd/rgbd_loop_closer.hpp"
#include "hm/slam/rgbd/testing/landmark_world.hpp"

namespace hm {
namespace {

using Keyframes = std::vector<std::shared_ptr<const Keyframe>>;

const Vec3 kRoom_m(2.0, 1.4, 1.8);  ///< half of its size
/// Looks into a corner of the room: three planes.
const SE3 kCorner(so3_exp(Vec3(0.5, 0.6, 0)), Vec3(0.1, 0.2, -0.3));

Keyframes keyframes_at(const std::vector<SE3>& T_odom_camera) {
  Keyframes keyframes;
  for (std::size_t i = 0; i < T_odom_camera.size(); ++i) {
    Keyframe keyframe;
    keyframe.frame_index = i;
    keyframe.stamp = Time::from_seconds(0.3 * static_cast<double>(i + 1));
    keyframe.T_odom_camera = T_odom_camera[i];
    keyframes.push_back(std::make_shared<const Keyframe>(std::move(keyframe)));
  }
  return keyframes;
}

/// Depth images at `T_world_camera` of the keyframe's frame_index, and then moved.
KeyframeDepths depths_in(const Vec3& half_size_m, const std::vector<SE3>& T_world_camera,
                         const SE3& T_camera_depth = {}) {
  const auto read = [=](const Keyframe& keyframe) -> std::optional<KeyframeDepth> {
    Rng rng(keyframe.frame_index + 1);
    const SE3 T_world_depth = T_world_camera[keyframe.frame_index] * T_camera_depth;
    return KeyframeDepth{test::depth_in_room(half_size_m, T_world_depth, rng), T_camera_depth};
  };
  return {read, {}};
}

TEST(KeyframeSurfaces, FactorFindsTheMotionInACorner) {
  const SE3 T_a_b = SE3::exp((Vec6() << 0.05, -0.03, 0.04, 0.02, 0.03, -0.02).finished());
  const SE3 T_camera_depth = SE3::exp((Vec6() << 0.004, 0.002, 0, 0.01, -0.005, 0.003).finished());
  const std::vector<SE3> truth{kCorner, kCorner * T_a_b};
  const KeyframeSurfaces surfaces(test::landmark_camera(), keyframes_at(truth),
                                  depths_in(kRoom_m, truth, T_camera_depth));
  const SE3 guess = T_a_b * SE3::exp((Vec6() << 0.01, -0.01, 0.008, 0.004, -0.004, 0.003).finished());
  const auto factor = surfaces.factor(0, 1, guess);
  ASSERT_TRUE(factor);
  const SE3 error = factor->T_from_to.inverse() * T_a_b;
  EXPECT_LT(error.translation().norm(), 0.003);
  EXPECT_LT(error.angle(), 0.002);
  // Honest: the error is within three standard deviations, none of which is below the shared error.
  EXPECT_LT(
      pose_edge_error(*factor, {}, T_a_b).dot(factor->information * pose_edge_error(*factor, {}, T_a_b)),
      6 * 9);
  const Vec6 values = symmetric_eigenvalues(factor->information);
  EXPECT_GT(values[0], 1e3);
  EXPECT_LT(values[5], 1.01 / (0.002 * 0.002));
}

TEST(KeyframeSurfaces, AWallHoldsItsNormalAndTwoTurns) {
  const std::vector<SE3> truth(2, SE3(Mat3::Identity(), Vec3(0, 0, 0.9)));
  const KeyframeSurfaces surfaces(test::landmark_camera(), keyframes_at(truth),
                                  depths_in(Vec3(9, 9, 2), truth));
  const SE3 guess(Mat3::Identity(), Vec3(0.01, 0, 0.01));
  const auto factor = surfaces.factor(0, 1, guess);
  ASSERT_TRUE(factor);
  EXPECT_NEAR(factor->T_from_to.translation().z(), 0, 0.001);
  EXPECT_NEAR(factor->T_from_to.translation().x(), 0.01, 0.002) << "along the wall the guess is kept";
  const Vec6 values = symmetric_eigenvalues(factor->information);
  EXPECT_LT(values[2], 0.02 * values[3]);
}

/// Depth images of a camera whose disparity is off: 1 / depth = 1 / reading + 0.02 1/m.
TEST(KeyframeSurfaces, TheyTellTheOffsetOfDisparity) {
  constexpr double kOffset_1_m = 0.02;
  const SE3 T_camera_depth = SE3::exp((Vec6() << 0.004, 0.002, 0, 0.01, -0.005, 0.003).finished());
  std::vector<SE3> truth;
  std::vector<KeyframePair> pairs;
  for (std::uint32_t i = 0; i < 10; ++i) {
    truth.push_back(
        SE3(so3_exp(Vec3(0.3 * std::sin(i), 0.3 * i, 0)), Vec3(0.7 * std::sin(2 * i), 0, 0.6 * std::cos(i))));
    if (i > 0) pairs.emplace_back(i - 1, i);
  }
  KeyframeDepths depths = depths_in(kRoom_m, truth, T_camera_depth);
  depths.read = [right = depths.read](const Keyframe& keyframe) {
    std::optional<KeyframeDepth> read = right(keyframe);
    for (int y = 0; y < read->depth.height(); ++y)
      for (std::uint16_t& units : read->depth.units.row(y)) {
        const double depth_m = units * read->depth.unit_m;
        units = static_cast<std::uint16_t>(
            std::lround(depth_m / (1 - kOffset_1_m * depth_m) / read->depth.unit_m));
      }
    return read;
  };
  const KeyframeSurfaces surfaces(test::landmark_camera(), keyframes_at(truth), depths);
  const DisparityOffset found = surfaces.disparity_offset(pairs, truth);
  EXPECT_TRUE(found.is_observed);
  EXPECT_NEAR(found.offset_1_m, kOffset_1_m, 0.004);
  EXPECT_LT(found.cost_ratio, 1);
}

TEST(KeyframeSurfaces, WithoutDepthImagesThereIsNothing) {
  const std::vector<SE3> poses(2, kCorner);
  const KeyframeSurfaces surfaces(test::landmark_camera(), keyframes_at(poses), {});
  const std::vector<KeyframePair> pair{{0, 1}};
  EXPECT_FALSE(surfaces.factor(0, 1, {}));
  EXPECT_EQ(surfaces.agreement(pair, poses, poses).views, 0U);
  EXPECT_FALSE(surfaces.disparity_offset(pair, poses).is_observed);
}

TEST(KeyframeSurfaces, TruePosesAgreeBetterThanDisturbedOnes) {
  const std::vector<SE3> truth{kCorner, kCorner * SE3::exp((Vec6() << 0.1, 0, 0, 0, 0.05, 0).finished())};
  std::vector<SE3> disturbed = truth;
  disturbed[1] = disturbed[1] * SE3(Mat3::Identity(), Vec3(0.02, 0.02, 0.02));
  const KeyframeSurfaces surfaces(test::landmark_camera(), keyframes_at(truth), depths_in(kRoom_m, truth));
  const std::vector<KeyframePair> pair{{0, 1}};
  const SurfaceAgreement found = surfaces.agreement(pair, disturbed, truth);
  EXPECT_EQ(found.views, 2U);
  EXPECT_GT(found.distance_m, 2 * found.other_distance_m);
  EXPECT_GT(found.cost, 2 * found.other_cost);
}

/// A camera that looks into a corner from the same places again and again; odometry is right. Features are
/// those of cameras elsewhere, some centimetres off: bundle adjustment follows them.
struct Misled {
  std::vector<SE3> truth, of_features;
  Keyframes keyframes;
};

Misled misled() {
  Misled scene;
  Rng rng(4);
  test::LandmarkWorld world;
  for (int i = 0; i < 1500; ++i) {
    Vec3 p = test::drawn<3>([&rng] { return rng.uniform(-1, 1); }).cwiseProduct(kRoom_m);
    const int axis = i % 3;
    p[axis] = std::copysign(kRoom_m[axis], p[axis]);
    world.points.push_back({p, test::random_descriptor(rng)});
  }
  for (int i = 0; i < 28; ++i) {
    const double angle = 0.45 * i;
    scene.truth.push_back(kCorner *
                          SE3(Mat3::Identity(), Vec3(0.15 * std::sin(angle), 0.1 * std::cos(angle), 0)));
    const Vec3 shift = 0.03 * Vec3(std::sin(2.4 * i), std::cos(1.7 * i), std::sin(3.1 * i + 1));
    scene.of_features.push_back(scene.truth.back() *
                                SE3(Mat3::Identity(), i == 0 ? Vec3(Vec3::Zero()) : shift));
  }
  for (const auto& bare : keyframes_at(scene.truth)) {
    Keyframe keyframe = *bare;
    keyframe.features = test::see(world, scene.of_features[keyframe.frame_index], rng);
    scene.keyframes.push_back(std::make_shared<const Keyframe>(std::move(keyframe)));
  }
  return scene;
}

RgbdAlignmentReport close_loops(const Misled& scene, const KeyframeDepths& depths, std::vector<SE3>& poses,
                                const RunContext& run = {}) {
  RgbdLoopCloser closer(test::landmark_camera());
  for (const auto& keyframe : scene.keyframes) closer.add(keyframe);
  const RgbdAlignmentReport report = closer.finish(run, depths);
  const CorrectedKeyframes corrected = closer.corrected();
  for (const CorrectedKeyframe& keyframe : corrected.keyframes()) poses.push_back(keyframe.T_map_camera);
  return report;
}

double rms_m(const std::vector<SE3>& poses, const std::vector<SE3>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < poses.size(); ++i)
    sum += (poses[i].translation() - truth[i].translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(poses.size()));
}

TEST(RgbdLoopCloser, RefusesAnAdjustmentThatDepthContradicts) {
  const Misled scene = misled();
  std::vector<SE3> without_depth, with_depth;
  EXPECT_TRUE(close_loops(scene, {}, without_depth).adjusted);
  const RgbdAlignmentReport report = close_loops(scene, depths_in(kRoom_m, scene.truth), with_depth);
  EXPECT_TRUE(report.refused);
  EXPECT_FALSE(report.adjusted);
  EXPECT_GT(report.agreement.views, 20U);
  EXPECT_GT(report.agreement.cost, RgbdLoopParams::kMaxSurfaceCostRatio * report.agreement.other_cost);
  EXPECT_LT(rms_m(with_depth, scene.truth), 0.5 * rms_m(without_depth, scene.truth));
}

TEST(RgbdLoopCloser, AStopWhileTheOffsetIsEstimatedLeavesThePoses) {
  const Misled scene = misled();
  const KeyframeDepths depths = depths_in(kRoom_m, scene.truth);
  std::vector<SE3> whole, stopped;
  EXPECT_FALSE(close_loops(scene, depths, whole).disparity.interrupted);
  std::stop_source stop;
  std::size_t offset_steps = 0;
  RunContext run;
  run.stop = stop.get_token();
  run.progress = [&](const Progress& now) {
    if (now.stage != "offset of disparity") return;
    ++offset_steps;
    stop.request_stop();
  };
  const RgbdAlignmentReport report = close_loops(scene, depths, stopped, run);
  EXPECT_EQ(offset_steps, 1U);
  EXPECT_TRUE(report.disparity.interrupted);
  EXPECT_FALSE(report.interrupted);
  EXPECT_TRUE(report.refused) << "the surfaces had been compared before";
  EXPECT_EQ(rms_m(stopped, whole), 0);
}

TEST(RgbdLoopCloser, KeepsAnAdjustmentThatDepthConfirms) {
  const Misled scene = misled();
  std::vector<SE3> without_depth, with_depth;
  close_loops(scene, {}, without_depth);
  const RgbdAlignmentReport report = close_loops(scene, depths_in(kRoom_m, scene.of_features), with_depth);
  EXPECT_TRUE(report.adjusted);
  EXPECT_FALSE(report.refused);
  EXPECT_GT(report.agreement.views, 20U);
  EXPECT_EQ(rms_m(with_depth, without_depth), 0);
}

}  // namespace
}  // namespace hm
