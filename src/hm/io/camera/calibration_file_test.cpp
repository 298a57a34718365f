#include "hm/io/camera/calibration_file.hpp"

#include <tuple>

#include <gmock/gmock.h>

#include "hm/core/hash.hpp"
#include "hm/core/rng.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/testing/io_test_support.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/io/testing/testing_recordings.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

DepthCorrectionModel some_correction(DepthFitMode mode = DepthFitMode::kSpline) {
  DepthCorrectionModel model;
  model.mode = mode;
  model.width = 24, model.height = 16;
  const bool smooth = mode == DepthFitMode::kSpline;
  model.columns = smooth ? 5 : 24, model.rows = smooth ? 4 : 16;
  model.terms = 2;
  model.min_depth_m = 0.7, model.max_depth_m = 3.3;
  Rng rng(3);
  const auto plane = static_cast<std::size_t>(model.columns * model.rows);
  for (std::size_t i = 0; i < 2 * plane; ++i)
    model.coefficients.push_back(static_cast<float>(rng.normal(0, 0.02)));
  if (!smooth) model.lowest_s.assign(plane, -0.5F), model.highest_s.assign(plane, 0.75F);
  return model;
}

RgbdCalibration some_calibration() {
  RgbdCalibration calibration;
  calibration.depth_camera =
      PinholeCamera{24, 16, 20.1, 19.9, 11.7, 8.1, {-0.025, 0.0002, -0.0009, 0.0002, 0.003}};
  calibration.color_camera = PinholeCamera{24, 16, 18.1, 18.3, 12.2, 7.9, {0.04, -0.11, 0.002, 0.0007, 0}};
  calibration.T_color_depth = SE3(so3_exp(Vec3(0.01, -0.02, 0.005)), Vec3(-0.026, -0.00005, 0.0006));
  calibration.disparity = DisparityModel{3.1, -0.0029};
  calibration.depth_correction = some_correction();
  calibration.poses_of = PosesOf::kDepthCamera;
  return calibration;
}

void expect_same(const PinholeCamera& a, const PinholeCamera& b) {
  EXPECT_EQ(std::tie(a.width, a.height, a.fx, a.fy, a.cx, a.cy),
            std::tie(b.width, b.height, b.fx, b.fy, b.cx, b.cy));
  EXPECT_EQ(std::tie(a.distortion.k1, a.distortion.k2, a.distortion.p1, a.distortion.p2, a.distortion.k3),
            std::tie(b.distortion.k1, b.distortion.k2, b.distortion.p1, b.distortion.p2, b.distortion.k3));
}

TEST(CalibrationFile, ReadsBackWhatWasWritten) {
  const TemporaryFolder folder;
  const RgbdCalibration written = some_calibration();
  ASSERT_TRUE(write_calibration(folder.path() / "c.toml", written));
  const auto read = read_calibration(folder.path() / "c.toml");
  ASSERT_TRUE(read) << to_string(read.error());
  expect_same(*read->depth_camera, *written.depth_camera);
  expect_same(*read->color_camera, *written.color_camera);
  EXPECT_LT((read->T_color_depth->matrix() - written.T_color_depth->matrix()).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_EQ(read->poses_of, PosesOf::kDepthCamera);
  ASSERT_TRUE(read->disparity);
  EXPECT_EQ(read->disparity->offset_per_m, 3.1);
  EXPECT_EQ(read->disparity->slope_per_m, -0.0029);
  EXPECT_EQ(read->depth_correction->coefficients, written.depth_correction->coefficients);
}

TEST(CalibrationFile, EveryTableIsOptionalButACamera) {
  const TemporaryFolder folder;
  RgbdCalibration one;
  one.color_camera = some_calibration().color_camera;
  ASSERT_TRUE(write_calibration(folder.path() / "c.toml", one));
  const auto read = read_calibration(folder.path() / "c.toml");
  ASSERT_TRUE(read);
  EXPECT_FALSE(read->depth_camera || read->T_color_depth || read->depth_correction || read->disparity);
  ASSERT_TRUE(write_file_text(folder.path() / "c.toml", "poses_of = \"color\"\n"));
  EXPECT_FALSE(read_calibration(folder.path() / "c.toml"));
}

/// The published code took a missing correction for one that is there.
TEST(CalibrationFile, AMissingCorrectionIsAnError) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_calibration(folder.path() / "c.toml", some_calibration()));
  fs::remove(folder.path() / "c.hmdc");
  const auto read = read_calibration(folder.path() / "c.toml");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(read.error().where, HasSubstr("c.hmdc"));
}

TEST(CalibrationFile, MistakesAreNamedWithTheirLine) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "c.toml";
  const std::string camera =
      "[color_camera]\nsize_px = [24, 16]\nfx_px = 20\nfy_px = 20\ncx_px = 12\ncy_px = 8\n";
  const auto error_of = [&](const std::string& text) {
    EXPECT_TRUE(write_file_text(path, text));
    const auto read = read_calibration(path);
    EXPECT_FALSE(read) << text;
    return read ? std::string() : to_string(read.error());
  };
  EXPECT_TRUE(write_file_text(path, camera));
  EXPECT_TRUE(read_calibration(path));
  EXPECT_THAT(error_of(camera + "fxx = 3\n"), HasSubstr("c.toml:7: unknown key `fxx`"));
  EXPECT_THAT(error_of(camera + "distortion = [1, 2]\n"), HasSubstr("c.toml:7: `distortion` takes 5"));
  EXPECT_THAT(error_of("[color_camera]\nsize_px = [24, 16]\nfx_px = 0\nfy_px = 20\ncx_px = 12\ncy_px = 8\n"),
              HasSubstr("fx = 0"));
  EXPECT_THAT(error_of("[color_camera]\nsize_px = [24.5, 16]\nfx_px = 9\n"), HasSubstr("whole numbers"));
  EXPECT_THAT(error_of(camera + "[T_color_depth]\nxyz_m = [0, 0, 0]\nquaternion_xyzw = [1, 1, 0, 0]\n"),
              HasSubstr("unit length"));
  EXPECT_THAT(error_of("poses_of = \"tail\"\n" + camera), HasSubstr("c.toml:1"));
  EXPECT_THAT(error_of(camera + "[depth_correction]\nfile = \"\"\n"), HasSubstr("NAME.hmdc"));
  EXPECT_THAT(error_of(camera + "[depth_disparity]\noffset_per_m = 3.3\nslope_per_m = 0.003\n"),
              HasSubstr("c.toml:7: [depth_disparity]"));
  EXPECT_THAT(error_of(camera + "[depth_disparity]\noffset_per_m = 3.3\n"), HasSubstr("`slope_per_m`"));
  EXPECT_THAT(error_of("[color_camera\n"), HasSubstr("c.toml:1"));
}

TEST(CalibrationFile, ACorrectionOfAnotherImageSizeIsRefused) {
  const TemporaryFolder folder;
  RgbdCalibration calibration = some_calibration();
  calibration.depth_camera->width = 48, calibration.depth_camera->height = 32;
  ASSERT_TRUE(write_calibration(folder.path() / "c.toml", calibration));
  const auto read = read_calibration(folder.path() / "c.toml");
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("24 x 16"));
}

class CorrectionFile : public testing::TestWithParam<DepthFitMode> {};

TEST_P(CorrectionFile, EveryPrefixAndEveryDamagedByteIsAnError) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "c.hmdc";
  const DepthCorrectionModel model = some_correction(GetParam());
  ASSERT_TRUE(write_depth_correction(path, model));
  const auto whole = read_depth_correction(path);
  ASSERT_TRUE(whole) << to_string(whole.error());
  EXPECT_EQ(whole->coefficients, model.coefficients);
  EXPECT_EQ(whole->lowest_s, model.lowest_s);
  EXPECT_EQ(whole->highest_s, model.highest_s);
  const auto bytes = *read_file_bytes(path);
  const std::size_t step = std::max<std::size_t>(1, bytes.size() / 150);
  for (std::size_t n = 0; n < bytes.size(); n += step) {
    fs::remove(path);
    ASSERT_TRUE(write_file_bytes(path, std::span(bytes).first(n)));
    ASSERT_FALSE(read_depth_correction(path)) << n;
  }
  for (std::size_t n = 0; n < bytes.size(); n += step) {
    auto damaged = bytes;
    damaged[n] ^= 0x10;
    fs::remove(path);
    ASSERT_TRUE(write_file_bytes(path, damaged));
    ASSERT_FALSE(read_depth_correction(path)) << n;
  }
}
INSTANTIATE_TEST_SUITE_P(Modes, CorrectionFile,
                         testing::Values(DepthFitMode::kSpline, DepthFitMode::kLinear));

/// Numbers that contradict each other under a right checksum: an Error, no crash and no huge allocation.
TEST(CalibrationFile, CorrectionsWithWrongNumbersAreErrors) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "c.hmdc";
  ASSERT_TRUE(write_depth_correction(path, some_correction()));
  const auto good = *read_file_bytes(path);
  Rng rng(5);
  int read_well = 0;
  for (int round = 0; round < 300; ++round) {
    auto bytes = good;
    bytes.resize(bytes.size() - 8);
    const std::size_t at = 8 + rng.below(36);
    bytes[at] = static_cast<std::uint8_t>(rng.below(256));
    const std::uint64_t hash = fnv1a(bytes);
    for (int i = 0; i < 8; ++i) bytes.push_back(static_cast<std::uint8_t>(hash >> (8 * i)));
    test::write_bytes(path, {bytes.begin(), bytes.end()});
    const auto read = read_depth_correction(path);
    if (read) {
      EXPECT_TRUE(check_model(*read));
      ++read_well;  // e.g. another trained range
    } else {
      EXPECT_THAT(read.error().where, HasSubstr("c.hmdc"));
    }
  }
  EXPECT_LT(read_well, 280);
}

TEST(CalibrationFile, CorruptedTomlNeverCrashes) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "c.toml";
  ASSERT_TRUE(write_calibration(path, some_calibration()));
  const std::string good = testing_recordings::file_text(path);
  Rng rng(9);
  for (int round = 0; round < 400; ++round) {
    std::string text = good;
    for (int change = 0; change < 3; ++change)
      text[rng.below(static_cast<std::uint32_t>(text.size()))] = "0123456789.-e=[]\"\n \xff"[rng.below(20)];
    if (round % 4 == 0) text.resize(rng.below(static_cast<std::uint32_t>(text.size())));
    test::write_bytes(path, text);
    const auto read = read_calibration(path);
    if (!read) {
      EXPECT_FALSE(read.error().where.empty());
    }
  }
}

TEST(CalibrationFile, DeepHeadersAndImplausibleCamerasAreRefused) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "calibration.toml";
  std::string dots = "[a";
  for (int i = 0; i < 40'000; ++i) dots += ".a";
  ASSERT_TRUE(write_file_text(path, dots + "]\n"));
  const auto deep = read_calibration(path);
  ASSERT_FALSE(deep);
  EXPECT_THAT(deep.error().message, HasSubstr("nested too deeply"));
  EXPECT_THAT(deep.error().where, HasSubstr("calibration.toml:1"));

  RgbdCalibration calibration = some_calibration();
  ASSERT_TRUE(write_calibration(path, calibration));
  std::string text = testing_recordings::file_text(path);
  const std::size_t at = text.find("fx_px = ") + 8;
  text.replace(at, text.find('\n', at) - at, "1e300");
  ASSERT_TRUE(write_file_text(path, text));
  const auto implausible = read_calibration(path);
  ASSERT_FALSE(implausible);
  EXPECT_THAT(implausible.error().message, HasSubstr("fx = 1e+300"));
}

TEST(CameraInfo, HasTheFormThatRosWrites) {
  const std::string yaml = camera_info_yaml(*some_calibration().color_camera, "rgb");
  EXPECT_THAT(yaml, HasSubstr("image_width: 24\nimage_height: 16\ncamera_name: rgb\n"));
  EXPECT_THAT(yaml, HasSubstr("data: [18.1, 0, 12.2, 0, 18.3, 7.9, 0, 0, 1]"));
  EXPECT_THAT(yaml, HasSubstr("distortion_model: plumb_bob"));
  EXPECT_THAT(yaml, HasSubstr("data: [0.04, -0.11, 0.002, 0.0007, 0]"));
  EXPECT_THAT(yaml, HasSubstr("data: [18.1, 0, 12.2, 0, 0, 18.3, 7.9, 0, 0, 0, 1, 0]"));
}

}  // namespace
}  // namespace hm
