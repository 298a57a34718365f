#include "hm/io/frame_calibration.hpp"

#include <gmock/gmock.h>

#include <hwy/targets.h>
#include <cmath>

#include "hm/io/calibration_file.hpp"
#include "hm/io/depth_registration.hpp"
#include "hm/io/lens_map.hpp"
#include "hm/io/registration_kernels.hpp"
#include "hm/io/testing_recordings.hpp"

namespace hm {
namespace {

using namespace testing_recordings;
namespace fs = std::filesystem;
using testing::HasSubstr;

const PinholeCamera kDepthCamera{160, 120, 145, 144, 79.2, 61.3, {}};
const PinholeCamera kColorCamera{160, 120, 134, 133.5, 80.3, 60.1, {}};
const SE3 kMotion(so3_exp(Vec3(0.004, -0.008, 0.002)), Vec3(-0.026, 0.001, 0.0006));

/// Depth of a plane n . p = d, seen by a camera.
double plane_depth(const PinholeCamera& camera, const Vec2& pixel, const Vec3& n, double d) {
  return d / n.dot(camera.unproject(pixel, 1.0));
}

TEST(DepthRegistration, APlaneStaysThePlane) {
  const Vec3 n_depth = Vec3(0.2, -0.1, 1).normalized();
  const double d_depth = 2.0;
  Image<std::uint16_t> depth(160, 120);
  const double unit = 1e-4;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x)
      depth(x, y) = static_cast<std::uint16_t>(
          std::lround(plane_depth(kDepthCamera, Vec2(x, y), n_depth, d_depth) / unit));
  const auto registered = DepthRegistration(kDepthCamera, kColorCamera, kMotion).apply(depth, unit);
  const Vec3 n_color = kMotion.rotation() * n_depth;
  const double d_color = d_depth + n_color.dot(kMotion.translation());
  int inside = 0, holes = 0;
  double sum = 0, worst = 0;
  for (int y = 8; y < 112; ++y)
    for (int x = 8; x < 152; ++x) {
      ++inside;
      if (registered(x, y) == 0) {
        ++holes;
        continue;
      }
      const double error = registered(x, y) * unit - plane_depth(kColorCamera, Vec2(x, y), n_color, d_color);
      sum += error;
      worst = std::max(worst, std::abs(error));
    }
  EXPECT_EQ(holes, 0) << "of " << inside;
  // A reading moves by up to half a pixel: up to 1.7 mm here. Cutting instead of rounding would shift the
  // mean.
  EXPECT_LT(worst, 0.0035);
  EXPECT_LT(std::abs(sum / inside), 2e-4);
}

/// Registration in double precision, one reading after the other. Readings within `margin` of where another
/// pixel or another unit begins are taken out of `depth`: single precision may decide differently there.
Image<std::uint16_t> registered_slowly(Image<std::uint16_t>& depth, double unit_m, double margin) {
  Image<std::uint16_t> registered(kColorCamera.width, kColorCamera.height);
  const auto near_border = [&](double value) {
    const double fraction = value + 0.5 - std::floor(value + 0.5);
    return fraction < margin || fraction > 1 - margin;
  };
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) {
      if (depth(x, y) == 0) continue;
      const Vec3 p = kMotion * kDepthCamera.unproject(Vec2(x, y), depth(x, y) * unit_m);
      const double z = p.z() / unit_m;
      const Vec2 pixel = kColorCamera.project(p);
      if (near_border(z) || near_border(pixel.x()) || near_border(pixel.y())) {
        depth(x, y) = 0;
        continue;
      }
      if (z < 0.5 || z >= 65534.5 || !kColorCamera.contains(pixel)) continue;
      std::uint16_t& place =
          registered(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
      const auto units = static_cast<std::uint16_t>(std::lround(z));
      if (place == 0 || units < place) place = units;
    }
  Image<std::uint16_t> filled = registered;
  const auto between = [](std::uint16_t a, std::uint16_t b) {
    const int mean = (a + b + 1) / 2;
    return static_cast<std::uint16_t>(a == 0 || b == 0 || std::abs(a - b) > mean * 1966 / 65536 ? 0 : mean);
  };
  for (int y = 0; y < filled.height(); ++y)
    for (int x = 0; x < filled.width(); ++x) {
      if (registered(x, y) != 0) continue;
      if (x > 0 && x + 1 < filled.width()) filled(x, y) = between(registered(x - 1, y), registered(x + 1, y));
      if (filled(x, y) == 0 && y > 0 && y + 1 < filled.height())
        filled(x, y) = between(registered(x, y - 1), registered(x, y + 1));
    }
  return filled;
}

TEST(DepthRegistration, EveryPixelIsThatOfTheSlowReference) {
  const DepthRegistration registration(kDepthCamera, kColorCamera, kMotion);
  for (const double unit_m : {1e-3, 2e-4}) {
    Rng rng(3);
    for (const double scatter : {0.0, 0.01, 1.0}) {
      Image<std::uint16_t> depth(160, 120);
      for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 160; ++x)
          if (rng.below(8) != 0)
            depth(x, y) = static_cast<std::uint16_t>(
                std::clamp((1.2 + 0.01 * x + scatter * rng.normal()) / unit_m, 0.0, 65535.0));
      const auto wanted = registered_slowly(depth, unit_m, 2e-3);
      EXPECT_TRUE(same_pixels(registration.apply(depth, unit_m), wanted)) << unit_m << ", " << scatter;
    }
  }
}

TEST(DepthRegistration, VectorsOfEveryKindGiveThePlainBits) {
  constexpr int kWidth = 77, kStride = 83, kSlack = DepthRegistration::kRowSlack_px;
  Rng rng(8);
  std::vector<float> columns[3];
  for (auto& list : columns)
    for (int x = 0; x < kWidth + kSlack; ++x) list.push_back(static_cast<float>(rng.uniform(-90, 90)));
  detail::ProjectedRow row;
  row.width = kWidth, row.stride = kStride, row.last_x = kStride - 1, row.last_y = 50;
  for (std::size_t i = 0; i < 3; ++i) {
    row.of_column[i] = columns[i].data();
    row.of_row[i] = static_cast<float>(rng.uniform(-1, 1));
    row.origin[i] = i < 2 ? static_cast<float>(rng.uniform(-9000, 9000)) : 0.0F;  // 0 / 0 is among them
  }
  for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    for (int round = 0; round < 50; ++round) {
      std::vector<std::uint16_t> depth(kWidth + kSlack), near_plain(depth), near_fast(depth);
      std::vector<std::int32_t> cells_plain(depth.size()), cells_fast(depth.size());
      for (auto& units : depth) units = static_cast<std::uint16_t>(rng.below(3) == 0 ? 0 : rng.below(65536));
      detail::project_row_plain(row, depth.data(), cells_plain.data(), near_plain.data());
      detail::project_row_simd(row, depth.data(), cells_fast.data(), near_fast.data());
      for (std::size_t x = 0; x < kWidth; ++x) {
        ASSERT_EQ(near_plain[x], near_fast[x]) << x << ", " << hwy::TargetName(left & -left);
        ASSERT_EQ(cells_plain[x], cells_fast[x]) << x << ", " << hwy::TargetName(left & -left);
        ASSERT_TRUE(cells_fast[x] >= 0 && cells_fast[x] < 51 * kStride) << cells_fast[x];
      }
      std::vector<std::uint16_t> cells(3 * kStride + 2 * kSlack), fill_plain(kWidth), fill_fast(kWidth);
      for (auto& cell : cells)
        cell = static_cast<std::uint16_t>(rng.below(3) == 0 ? 65535 : rng.below(60) + 900 * (round % 70));
      detail::fill_row_plain(cells.data() + kStride + 1, kStride, kWidth, fill_plain.data());
      detail::fill_row_simd(cells.data() + kStride + 1, kStride, kWidth, fill_fast.data());
      ASSERT_EQ(fill_plain, fill_fast) << hwy::TargetName(left & -left);
    }
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST(DepthRegistration, NearestReadingWins) {
  Image<std::uint16_t> depth(160, 120);
  // Two readings on one ray of the colour camera.
  const Vec3 ray = kColorCamera.unproject(Vec2(70, 50), 1.0);
  const auto place = [&](double z) { return kDepthCamera.project(kMotion.inverse() * Vec3(z * ray)); };
  for (const double z : {1.0, 3.0}) {
    const Vec2 at = place(z);
    depth(static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y()))) =
        static_cast<std::uint16_t>(z * 1000);
  }
  const auto registered = DepthRegistration(kDepthCamera, kColorCamera, kMotion).apply(depth, 1e-3);
  EXPECT_NEAR(registered(70, 50), 1000, 5);
}

TEST(DepthRegistration, FillsOnlyHolesOfOnePixelOnOneSurface) {
  PinholeCamera camera = kDepthCamera;
  Image<std::uint16_t> depth(160, 120, 2000);
  depth(20, 20) = 0;                  // one pixel: filled
  depth(40, 40) = depth(41, 40) = 0;  // two wide, one high: filled from above and below
  for (int y = 59; y < 62; ++y)
    for (int x = 59; x < 62; ++x) depth(x, y) = 0;  // three by three: stays
  for (int y = 80; y < 90; ++y) {                   // a gap between two depths: stays
    for (int x = 81; x < 90; ++x) depth(x, y) = 3000;
    depth(80, y) = 0;
  }
  const auto same = DepthRegistration(camera, camera, SE3()).apply(depth, 1e-3);
  EXPECT_EQ(same(20, 20), 2000);
  EXPECT_EQ(same(40, 40), 2000);
  EXPECT_EQ(same(60, 60), 0);
  EXPECT_EQ(same(59, 59), 0);
  EXPECT_EQ(same(80, 85), 0);
}

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
