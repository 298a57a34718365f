#include "hm/odometry/tracker/motion_filter.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "hm/odometry/testing/textured_room.hpp"

namespace hm {
namespace {

constexpr int kFrames = 40;

DepthGrid grid_at(const SE3& T_world_camera, std::uint64_t seed) {
  Rng rng(seed);
  const RgbdFrame frame = render_room({}, room_camera(), T_world_camera, {}, {true, 0, {}}, &rng);
  return make_depth_grid(frame.depth, room_camera(), {}, 5.5);
}

/// Path past a corner of the room, where surfaces constrain every motion.
SE3 corner_pose(int frame) {
  const SE3 corner(so3_exp(Vec3(0.5, 0.6, 0)), Vec3(0.1, 0.2, -0.3));
  return corner * path_pose(frame / 30.0);
}

/// Depth grids along this path.
const std::vector<DepthGrid>& way() {
  static const std::vector<DepthGrid> kGrids = [] {
    std::vector<DepthGrid> grids;
    for (int i = 0; i < kFrames; ++i)
      grids.push_back(grid_at(corner_pose(i), 100 + static_cast<std::uint64_t>(i)));
    return grids;
  }();
  return kGrids;
}

SE3 trembling(Rng& rng, double sigma_m, double sigma_rad) {
  Vec6 xi;
  for (int i = 0; i < 6; ++i) xi[i] = rng.normal(0, i < 3 ? sigma_m : sigma_rad);
  return SE3::exp(xi);
}

/// Root mean square error of the frame-to-frame motion, metres.
double motion_error_m(const std::vector<SE3>& poses) {
  double sum = 0;
  for (int i = 11; i < kFrames; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const SE3 truth = corner_pose(i - 1).inverse() * corner_pose(i);
    sum += (truth.inverse() * poses[at - 1].inverse() * poses[at]).translation().squaredNorm();
  }
  return std::sqrt(sum / (kFrames - 11));
}

struct Tremble {
  double sigma_m = 0, sigma_rad = 0;
};

/// The model's poses along the path, and the filter's.
std::pair<std::vector<SE3>, std::vector<SE3>> follow(const Tremble& tremble) {
  Rng rng(5);
  MotionFilter filter({});
  std::pair<std::vector<SE3>, std::vector<SE3>> poses;
  for (int i = 0; i < kFrames; ++i) {
    const SE3 model = corner_pose(i) * trembling(rng, tremble.sigma_m, tremble.sigma_rad);
    const DepthGrid& grid = way()[static_cast<std::size_t>(i)];
    if (i == 0) filter.restart(grid, model);
    poses.first.push_back(model);
    poses.second.push_back(i == 0 ? model : filter.update(grid, model));
  }
  return poses;
}

TEST(MotionFilter, TakesTheTremblingOutOfTheModelsPoses) {
  const auto [model, filtered] = follow({0.003, 0.002});
  EXPECT_LT(motion_error_m(filtered), 0.6 * motion_error_m(model));
  for (int i = 0; i < kFrames; ++i)
    EXPECT_LT((filtered[static_cast<std::size_t>(i)].inverse() * corner_pose(i)).translation().norm(), 0.01)
        << i;
}

TEST(MotionFilter, LeavesPosesThatDoNotTremble) {
  const auto [model, filtered] = follow({0, 0});
  for (std::size_t i = 0; i < filtered.size(); ++i)
    EXPECT_LT((filtered[i].inverse() * model[i]).translation().norm(), i < 12 ? 0.003 : 0.001) << i;
}

TEST(MotionFilter, FollowsTheModelInTheLongRun) {
  MotionFilter filter({});
  const DepthGrid& grid = way()[0];
  filter.restart(grid, {});
  const SE3 moved(so3_exp(Vec3(0, 0.01, 0)), Vec3(0.02, 0, 0.01));  // the model, not the camera
  std::vector<double> left_m;
  for (int i = 0; i < 60; ++i)
    left_m.push_back((filter.update(grid, moved).translation() - moved.translation()).norm());
  EXPECT_GT(left_m[0], 0.003);  // does not jump with it
  EXPECT_LT(left_m[59], 0.001);
}

TEST(MotionFilter, DoesNotTakeAMovedModelForMotion) {
  MotionFilter filter({});
  filter.restart(way()[0], {});
  for (int i = 0; i < 30; ++i) filter.update(way()[0], {});
  const Mat6 before = filter.covariance_in_odom();
  const SE3 moved(Mat3::Identity(), Vec3(0.02, 0, 0));
  filter.model_moved(moved);
  filter.update(way()[0], moved);
  EXPECT_LT((filter.covariance_in_odom() - before).norm(), 0.2 * before.norm());
}

/// All that the depth image shows moves with the camera, by 2 cm a frame, as a person who walks ahead.
TEST(MotionFilter, DoesNotWalkAwayWithWhatWalksAhead) {
  MotionFilter filter({});
  const auto at = [](int i) { return SE3(Mat3::Identity(), Vec3(0, 0, 0.02 * i)); };
  filter.restart(way()[0], at(0));
  for (int i = 0; i < 20; ++i) filter.update(way()[0], at(0));
  for (int i = 1; i < 40; ++i) {
    const double off_m = (filter.update(way()[0], at(i)).translation() - at(i).translation()).norm();
    EXPECT_LT(off_m, i < 30 ? 0.02 : 0.006) << i;
  }
}

TEST(MotionFilter, WithoutDepthGivesTheModelsPoses) {
  MotionFilter filter({});
  DepthGrid blind = way()[0];
  std::fill(blind.depth_m.pixels().begin(), blind.depth_m.pixels().end(), 0.0f);
  filter.restart(blind, {});
  for (int i = 1; i < 5; ++i) {
    const SE3 model = path_pose(0.3 * i);
    EXPECT_LT((filter.update(blind, model).inverse() * model).log().norm(), 1e-9);
  }
}

/// A wall seen frontally does not constrain motion along it.
TEST(MotionFilter, AWallTakesNothingFromTheModelAlongIt) {
  TexturedRoom wall;
  wall.half_size_m = Vec3(20, 20, 1.5);
  const auto grid = [&] {
    return make_depth_grid(render_room(wall, room_camera(), {}, {}).depth, room_camera(), {}, 5.5);
  }();
  MotionFilter filter({});
  filter.restart(grid, {});
  for (int i = 1; i < 20; ++i) {
    const SE3 model(Mat3::Identity(), Vec3(0.01 * i, -0.005 * i, 0));
    const Vec3 off = filter.update(grid, model).translation() - model.translation();
    EXPECT_LT(off.norm(), 5e-4) << i;
  }
}

}  // namespace
}  // namespace hm
