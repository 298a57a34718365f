#include "hm/depth_camera/frame_calibration.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <thread>

#include "hm/depth_camera/depth_registration.hpp"
#include "hm/depth_camera/lens_map.hpp"
#include "hm/io/camera/calibration_file.hpp"
#include "hm/io/testing/testing_recordings.hpp"

namespace hm {
namespace {

using namespace testing_recordings;
namespace fs = std::filesystem;
using testing::HasSubstr;

const PinholeCamera kDepthCamera{160, 120, 145, 144, 79.2, 61.3, {}};
const PinholeCamera kColorCamera{160, 120, 134, 133.5, 80.3, 60.1, {}};
const SE3 kMotion(so3_exp(Vec3(0.004, -0.008, 0.002)), Vec3(-0.026, 0.001, 0.0006));

RgbdCalibration whole_calibration() {
  RgbdCalibration calibration;
  calibration.depth_camera = kDepthCamera;
  calibration.depth_camera->distortion = {-0.08, 0.01, 0.001, -0.0005, 0};
  calibration.color_camera = kColorCamera;
  calibration.color_camera->distortion = {0.04, -0.11, 0.002, 0.0007, 0};
  calibration.T_color_depth = kMotion;
  DepthCorrectionModel model;
  model.width = 160, model.height = 120, model.columns = 6, model.rows = 5, model.terms = 2;
  model.min_depth_m = 0.5, model.max_depth_m = 4;
  Rng rng(2);
  for (int i = 0; i < 60; ++i) model.coefficients.push_back(static_cast<float>(rng.uniform(-0.2, 0.2)));
  calibration.depth_correction = model;
  return calibration;
}

/// Memory is reused, but results do not depend on earlier images, on any thread.
TEST(FrameCalibration, FramesDoNotDependOnTheOnesBefore) {
  const RgbdCalibration calibration = whole_calibration();
  const auto frames = FrameCalibration::make(calibration, 160, 120);
  ASSERT_TRUE(frames);
  std::vector<DepthImage> raw, wanted;
  for (int i = 0; i < 6; ++i) {
    raw.push_back(testing_recordings::random_depth(160, 120, static_cast<std::uint64_t>(i) + 4));
    if (i % 2 == 1) std::ranges::fill(raw.back().units.pixels(), std::uint16_t{0});
    wanted.push_back(FrameCalibration::make(calibration, 160, 120)->calibrate(raw.back()));
  }
  for (const DepthImage& image : wanted) EXPECT_EQ(image.width(), 160);
  std::vector<int> wrong(3);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < wrong.size(); ++t)
    threads.emplace_back([&, t] {
      for (std::size_t i = 0; i < 24; ++i) {
        const std::size_t k = (i + t) % raw.size();
        wrong[t] += same_pixels(frames->calibrate(raw[k]).units, wanted[k].units) ? 0 : 1;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(wrong, testing::Each(0));
}

/// Rectify, correct, register: any other order gives another image.
TEST(FrameCalibration, TheOrderIsRectifyCorrectRegister) {
  const RgbdCalibration calibration = whole_calibration();
  const auto frames = FrameCalibration::make(calibration, 160, 120);
  ASSERT_TRUE(frames) << to_string(frames.error());
  DepthImage raw{Image<std::uint16_t>(160, 120), 1e-3};
  Rng rng(4);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x)
      raw.units(x, y) = static_cast<std::uint16_t>(rng.below(9) == 0 ? 0 : 1500 + 5 * x + rng.below(30));
  const LensMap lens(*calibration.depth_camera);
  const DepthCorrection correction(*calibration.depth_correction, 160, 120);
  const DepthRegistration registration(kDepthCamera, kColorCamera, kMotion);
  DepthImage wanted{lens.undistort(raw.units), raw.unit_m};
  correction.apply(wanted);
  wanted.units = registration.apply(wanted.units, raw.unit_m);
  const DepthImage got = frames->calibrate(raw);
  EXPECT_TRUE(same_pixels(got.units, wanted.units));

  DepthImage other = raw;
  correction.apply(other);
  other.units = registration.apply(lens.undistort(other.units), raw.unit_m);
  EXPECT_FALSE(same_pixels(other.units, wanted.units)) << "the test would not notice another order";
  EXPECT_TRUE(frames->camera().distortion.is_zero());
  EXPECT_EQ(frames->camera().fx, kColorCamera.fx);
  const auto color = random_color(160, 120, 3);
  EXPECT_TRUE(same_pixels(frames->calibrate(color), LensMap(*calibration.color_camera).undistort(color)));
}

TEST(FrameCalibration, OnlyWhatIsThereIsApplied) {
  RgbdCalibration calibration;
  calibration.depth_camera = kDepthCamera;
  const auto frames = FrameCalibration::make(calibration, 160, 120);
  ASSERT_TRUE(frames);
  const DepthImage raw = testing_recordings::random_depth(160, 120, 4);
  EXPECT_TRUE(same_pixels(frames->calibrate(raw).units, raw.units));
  EXPECT_EQ(frames->camera().fx, kDepthCamera.fx);
  const auto scaled = FrameCalibration::make(calibration, 80, 60);
  ASSERT_TRUE(scaled);
  EXPECT_NEAR(scaled->camera().fx, kDepthCamera.fx / 2, 1e-12);
  EXPECT_FALSE(FrameCalibration::make(calibration, 160, 100));
  EXPECT_FALSE(FrameCalibration::make(RgbdCalibration{}, 160, 120));
}

/// A recording with calibration.toml in its folder gives calibrated frames; without it the raw ones.
TEST(FrameCalibration, RecordingsAreCalibrated) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "recording";
  write_small_tum(path, 3);
  const auto plain = open_recording(path);
  ASSERT_TRUE(plain);
  RgbdCalibration calibration;
  calibration.depth_camera = kSmallCamera;
  calibration.depth_camera->distortion.k1 = -0.1;
  calibration.color_camera = PinholeCamera{24, 16, 22, 23, 11, 8, {}};
  calibration.T_color_depth = kMotion;
  calibration.poses_of = PosesOf::kDepthCamera;
  ASSERT_TRUE(write_calibration(path / kCalibrationFileName, calibration));
  const auto calibrated = open_recording(path);
  ASSERT_TRUE(calibrated) << to_string(calibrated.error());
  EXPECT_EQ((*calibrated)->info().camera.fx, 22);
  EXPECT_THAT((*calibrated)->info().calibration, HasSubstr("registered"));
  const auto raw = (*plain)->read(1), frame = (*calibrated)->read(1);
  ASSERT_TRUE(raw && frame);
  const auto frames = FrameCalibration::make(calibration, 24, 16);
  EXPECT_TRUE(same_pixels(frame->depth.units, frames->calibrate(raw->depth).units));
  const SE3 wanted = *raw->T_world_camera * kMotion.inverse();
  EXPECT_LT(pose_difference(*frame->T_world_camera, wanted), 1e-12);

  RecordingOptions by_hand;
  by_hand.camera = kSmallCamera;
  const auto without = open_recording(path, by_hand);
  ASSERT_TRUE(without);
  EXPECT_TRUE((*without)->info().calibration.empty());
  by_hand.calibration = path / kCalibrationFileName;
  const auto both = open_recording(path, by_hand);
  ASSERT_FALSE(both);
  EXPECT_EQ(both.error().code, ErrorCode::kUsage);
  RecordingOptions missing;
  missing.calibration = path / "no.toml";
  const auto error = open_recording(path, missing);
  ASSERT_FALSE(error);
  EXPECT_EQ(error.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(error.error().where, HasSubstr("no.toml"));
}

}  // namespace
}  // namespace hm
