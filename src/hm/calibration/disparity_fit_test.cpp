#include "hm/calibration/disparity_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/calibration/calibration_test_support.hpp"

namespace hm {
namespace {

using namespace testing_calibration;

const BoardParams kKinectBoard;  // 9 x 6, 0.1 m

/// Device that differs from the nominal one.
DisparityCamera true_device() {
  DisparityCamera device = nominal_kinect();
  device.camera.fx = 585, device.camera.fy = 584, device.camera.cx = 316, device.camera.cy = 244;
  device.T_color_depth = SE3(so3_exp(Vec3(0.004, -0.006, 0.003)), Vec3(-0.0235, 0.001, 0.002));
  device.disparity = {3.12, -0.00285};
  return device;
}

struct Noise {
  double disparity = 0.5;
  double hand_ratio = 0;  ///< share of a board's pixels that are occluded
};

/// Readings of boards by the true device, in integer units of disparity, converted with the nominal
/// constants.
std::vector<DepthPose> boards_seen(int count, const Noise& noise, Rng& rng) {
  std::vector<DepthPose> poses;
  const DisparityCamera device = true_device(), nominal = nominal_kinect();
  for (int i = 0; i < count; ++i) {
    DepthPose pose;
    pose.T_color_board = random_pose(kColorCamera, kKinectBoard, 0.9 + 1.4 * i / count, rng);
    const SE3 T_depth_board = device.T_color_depth.inverse() * pose.T_color_board;
    const Vec3 middle = T_depth_board * Vec3(0.5 * corner_on_board(kKinectBoard, 53));
    const Vec2 at = device.camera.project(middle);
    const double half = 0.25 * device.camera.fx / middle.z();
    for (double y = std::max(0.0, at.y() - half); y < std::min(480.0, at.y() + half); y += 3)
      for (double x = std::max(0.0, at.x() - half); x < std::min(640.0, at.x() + half); x += 3) {
        const Vec2 pixel(std::floor(x), std::floor(y));
        double z = plane_depth_m(device.camera, T_depth_board, pixel);
        if (noise.hand_ratio > 0 && x - at.x() < (2 * noise.hand_ratio - 1) * half) z -= 0.08;
        const double d = std::round(device.disparity.disparity(z) + rng.normal(0, noise.disparity));
        pose.depth.samples.push_back(
            {static_cast<std::int16_t>(pixel.x()), static_cast<std::int16_t>(pixel.y()),
             static_cast<float>(nominal.disparity.depth_m(d)), static_cast<float>(z), 0.0F});
      }
    poses.push_back(std::move(pose));
  }
  return poses;
}

/// Largest relative depth error of the fitted model for true disparities, over the image.
double worst_depth_ratio(const DisparityModel& found) {
  double worst = 0;
  for (const double z : {0.9, 1.5, 2.3})
    worst = std::max(worst, std::abs(found.depth_m(true_device().disparity.disparity(z)) / z - 1));
  return worst;
}

TEST(DisparityFit, DeviceIsFoundWithinItsDeviationsOverSeeds) {
  for (const int seed : {1, 2, 3, 4}) {
    Rng rng(static_cast<std::uint64_t>(seed));
    const auto fit = fit_disparity_camera(boards_seen(20, {}, rng), nominal_kinect());
    ASSERT_TRUE(fit) << to_string(fit.error());
    EXPECT_GT(fit->before_rms, 5 * fit->after_rms);
    EXPECT_LT(fit->after_rms, 0.3) << "some 30 readings a block, of 0.6 units each";
    EXPECT_LT(worst_depth_ratio(fit->found.disparity), 2e-3);
    EXPECT_NEAR(fit->found.camera.fx, true_device().camera.fx, 2.5);
    EXPECT_NEAR(fit->found.camera.cy, true_device().camera.cy, 2.5);
    const Vec3 off = fit->found.T_color_depth.translation() - true_device().T_color_depth.translation();
    EXPECT_LT(off.norm(), 0.004);
    EXPECT_LT(std::abs(off.z()), 5 * fit->translation_sigma_m.z() + 5e-4);
    EXPECT_GT(fit->focal_sigma_px, 0);
    EXPECT_LT(fit->focal_sigma_px, 3);
  }
}

TEST(DisparityFit, HandsBeforeTheBoardCountLittle) {
  Rng rng(5);
  const auto fit = fit_disparity_camera(boards_seen(20, {.hand_ratio = 0.2}, rng), nominal_kinect());
  ASSERT_TRUE(fit);
  EXPECT_LT(worst_depth_ratio(fit->found.disparity), 5e-3);
}

TEST(DisparityFit, KnownDeviceStays) {
  Rng rng(6);
  DisparityCamera start = true_device();
  start.disparity = {};  // constants that the readings were converted with
  const auto fit = fit_disparity_camera(boards_seen(10, {}, rng), start, {1e-3, 1e-3, 1e-6, 1e-6});
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->found.camera.fx, true_device().camera.fx, 0.01);
  EXPECT_LT(worst_depth_ratio(fit->found.disparity), 1e-3);
}

TEST(DisparityFit, TooFewBoardsAreAnError) {
  Rng rng(7);
  std::vector<DepthPose> poses = boards_seen(4, {}, rng);
  poses[1].depth.samples.clear(), poses[3].depth.samples.clear();
  const auto fit = fit_disparity_camera(poses, nominal_kinect());
  ASSERT_FALSE(fit);
  EXPECT_NE(fit.error().message.find("2 boards"), std::string::npos) << fit.error().message;
}

TEST(Disparity, ConstantsOfTheKinectGiveDepthsThatArePublished) {
  const DisparityModel kinect;
  EXPECT_NEAR(kinect.depth_m(500), 0.557, 0.001);
  EXPECT_NEAR(kinect.depth_m(1000), 3.849, 0.005);
  EXPECT_EQ(kinect.depth_m(1090), 0) << "beyond infinity";
  for (const double d : {400.0, 700.0, 1050.0}) EXPECT_NEAR(kinect.disparity(kinect.depth_m(d)), d, 1e-9);
}

TEST(Disparity, TableConvertsPicturesInPlace) {
  Image<std::uint16_t> raw(5, 1);
  raw(0, 0) = 700, raw(1, 0) = 2047, raw(2, 0) = 1090, raw(3, 0) = 60000, raw(4, 0) = 0;
  DisparityTable({}, 1e-3).apply(raw);
  EXPECT_EQ(raw(0, 0), std::lround(1000 * DisparityModel().depth_m(700)));
  for (const int x : {1, 2, 3, 4}) EXPECT_EQ(raw(x, 0), 0) << x;
  EXPECT_FALSE(check_disparity({3.3, 0.003}));
  EXPECT_FALSE(check_disparity({std::nan(""), -0.003}));
  EXPECT_TRUE(check_disparity({}));
}

}  // namespace
}  // namespace hm
