#include "hm/pipeline/calibrate/calibration_depth.hpp"

#include <gtest/gtest.h>

#include "hm/io/camera/calibration_file.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/pipeline/calibrate/calibration_simulation.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

/// What the simulated device says instead of depth; not the published constants.
constexpr DisparityModel kDevice{3.12, -0.00285};

/// Simulated boards whose depth images are turned into raw disparity, with a calibration of the colour
/// camera alone to start from.
class RawDisparity : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    boards_ = new TemporaryFolder;
    CalibrationSimulationOptions simulation;
    simulation.params.camera_views = 3, simulation.params.stereo_views = 1;
    simulation.params.depth_steps = 4, simulation.params.test_steps = 2, simulation.params.depth_images = 2;
    simulation.params.max_distance_m = 2.2, simulation.params.warp_at_4m_m = 0;
    simulation.output = boards_->path() / "boards";
    ASSERT_TRUE(simulate_calibration(simulation));
    for (const auto& entry : fs::recursive_directory_iterator(simulation.output / "depth"))
      if (entry.path().filename().string().starts_with("depth_")) make_raw(entry.path());
  }
  static void TearDownTestSuite() { delete boards_; }
  void SetUp() override {
    const fs::path set = boards_->path() / "boards";
    truth_ = *read_calibration(set / "truth" / kCalibrationFileName);
    RgbdCalibration start;
    start.color_camera = truth_.color_camera;
    ASSERT_TRUE(write_calibration(folder_.path() / "color.toml", start));
    options_.set = set / "depth", options_.start = folder_.path() / "color.toml";
    options_.output = folder_.path() / "result";
    options_.images = DepthImages::kRawDisparity;
  }
  static void make_raw(const fs::path& path) {
    auto units = read_depth_image(path);
    ASSERT_TRUE(units);
    for (std::uint16_t& pixel : units->pixels())
      pixel = pixel == 0 ? DisparityTable::kNone
                         : static_cast<std::uint16_t>(std::lround(kDevice.disparity(pixel * 1e-3)));
    ASSERT_TRUE(write_png(path, *units, PngEffort::kFast));
  }
  inline static TemporaryFolder* boards_ = nullptr;  ///< shared: simulating takes seconds
  TemporaryFolder folder_;
  RgbdCalibration truth_;
  DepthCalibrationOptions options_;
};

TEST_F(RawDisparity, ConstantsAndDepthCameraAreFoundWithoutInfraredPictures) {
  const auto summary = calibrate_depth(options_);
  ASSERT_TRUE(summary) << to_string(summary.error());
  ASSERT_TRUE(summary->raw);
  EXPECT_TRUE(summary->raw->is_nominal_start);
  const DisparityModel found = summary->raw->fit.found.disparity;
  for (const double z : {1.0, 1.5, 2.2}) EXPECT_NEAR(found.depth_m(kDevice.disparity(z)), z, 0.006 * z);
  EXPECT_LT(summary->raw->fit.after_rms, 0.6);
  EXPECT_NEAR(summary->raw->fit.found.camera.fx, truth_.depth_camera->fx, 8);
  const Vec3 off = summary->calibration.T_color_depth->translation() - truth_.T_color_depth->translation();
  EXPECT_LT(off.norm(), 0.015);

  const auto written = read_calibration(options_.output / kCalibrationFileName);
  ASSERT_TRUE(written) << to_string(written.error());
  ASSERT_TRUE(written->disparity && written->registers_depth() && written->depth_correction);
  EXPECT_NEAR(written->disparity->slope_per_m, found.slope_per_m, 1e-12);
}

TEST_F(RawDisparity, DepthInsteadOfDisparityIsSaidToBeSo) {
  for (const char* pose : {"000", "001", "002"}) {
    const fs::path folder = folder_.path() / "depth" / pose;
    fs::create_directories(folder);
    fs::copy(options_.set / "train" / "000" / "color.png", folder / "color.png");
    ASSERT_TRUE(write_png(folder / "depth_000.png", Image<std::uint16_t>(640, 480, 3000), PngEffort::kFast));
  }
  options_.set = folder_.path() / "depth";
  const auto summary = calibrate_depth(options_);
  ASSERT_FALSE(summary);
  EXPECT_NE(to_string(summary.error()).find("raw disparity has 11 bits"), std::string::npos)
      << to_string(summary.error());
}

TEST_F(RawDisparity, WithoutAColorCameraTheErrorSaysWhatIsNeeded) {
  RgbdCalibration start;
  start.depth_camera = truth_.depth_camera;
  ASSERT_TRUE(write_calibration(options_.start, start));
  const auto summary = calibrate_depth(options_);
  ASSERT_FALSE(summary);
  EXPECT_NE(to_string(summary.error()).find("colour camera"), std::string::npos);
}

}  // namespace
}  // namespace hm
