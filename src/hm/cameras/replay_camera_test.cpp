#include "hm/cameras/replay_camera.hpp"

#include <gtest/gtest.h>

#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/camera/calibration_file.hpp"
#include "hm/io/testing/testing_recordings.hpp"

namespace hm {
namespace {

using Kind = CameraEvent::Kind;
using std::chrono::milliseconds;
using testing_recordings::small_frame;

class ReplayCamera : public testing::Test {
 protected:
  void SetUp() override { testing_recordings::write_small_tum(recording(), 5); }
  [[nodiscard]] std::filesystem::path recording() const { return folder_ / "recording"; }
  std::unique_ptr<CameraDriver> open(CameraRequest request) {
    request.camera = "replay:" + recording().string();
    auto camera = open_camera(request);
    EXPECT_TRUE(camera) << to_string(camera.error());
    return std::move(*camera);
  }
  TemporaryFolder folder_;
};

TEST_F(ReplayCamera, GivesTheRecordingAtItsPace) {
  CameraRequest request;
  request.replay_speed = 4;
  const auto camera = open(request);
  EXPECT_EQ(camera->describe().camera.width, testing_recordings::kSmallCamera.width);
  EXPECT_NEAR(camera->describe().rate_hz, 10, 0.01);
  const auto begin = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < 5; ++i) {
    const CameraEvent event = camera->next(milliseconds(5'000));
    ASSERT_EQ(event.kind, Kind::kFrame) << event.reason;
    EXPECT_EQ(event.frame.stamp, small_frame(i).stamp);
    EXPECT_EQ(event.frame.depth.units(5, 5), small_frame(i).depth.units(5, 5));
    EXPECT_FALSE(event.frame.T_world_camera) << "a camera does not know where it is";
  }
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
  EXPECT_GE(time.count(), 0.1) << "0.4 s at four times the pace";
  EXPECT_EQ(camera->next(milliseconds(10)).kind, Kind::kEnd);
}

TEST_F(ReplayCamera, TimesOutBeforeTheNextFrameIsDue) {
  const auto camera = open({});
  EXPECT_EQ(camera->next(milliseconds(1'000)).kind, Kind::kFrame);
  EXPECT_EQ(camera->next(milliseconds(1)).kind, Kind::kTimeout);
  EXPECT_EQ(camera->next(milliseconds(1'000)).frame.stamp, small_frame(1).stamp) << "nothing was lost";
}

TEST_F(ReplayCamera, IsUnpluggedWhereAskedTo) {
  CameraRequest request;
  request.replay_speed = 100;
  request.replay_unplug_s = 0.25;
  const auto camera = open(request);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(camera->next(milliseconds(1'000)).kind, Kind::kFrame);
  const CameraEvent event = camera->next(milliseconds(1'000));
  EXPECT_EQ(event.kind, Kind::kFailed);
  EXPECT_NE(event.reason.find("unplugged after 0.25 s"), std::string::npos) << event.reason;
}

TEST_F(ReplayCamera, ContinuesAfterAStamp) {
  CameraRequest request;
  request.after = small_frame(2).stamp;
  EXPECT_EQ(open(request)->next(milliseconds(1'000)).frame.stamp, small_frame(3).stamp);
}

TEST_F(ReplayCamera, AnUnreadableImageIsIncomplete) {
  for (const auto& entry : std::filesystem::directory_iterator(recording() / "depth"))
    if (entry.path().filename().string() == stamp_text(small_frame(1).stamp) + ".png")
      std::filesystem::resize_file(entry.path(), 20);
  CameraRequest request;
  request.replay_speed = 100;
  const auto camera = open(request);
  EXPECT_EQ(camera->next(milliseconds(1'000)).kind, Kind::kFrame);
  const CameraEvent event = camera->next(milliseconds(1'000));
  EXPECT_EQ(event.kind, Kind::kIncomplete);
  EXPECT_FALSE(event.reason.empty());
  EXPECT_EQ(camera->next(milliseconds(1'000)).kind, Kind::kFrame);
}

TEST(OpenCamera, ACalibrationOfDisparityNeedsACameraThatGivesIt) {
  const TemporaryFolder folder;
  RgbdCalibration calibration;
  calibration.depth_camera = calibration.color_camera = testing_recordings::kSmallCamera;
  calibration.disparity.emplace();
  ASSERT_TRUE(write_calibration(folder / "calibration.toml", calibration));
  const auto opened =
      open_camera({.camera = "v4l2:/nowhere,/nowhere", .calibration = folder / "calibration.toml"});
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kUsage) << to_string(opened.error());
}

TEST(OpenCamera, SaysWhatIsWrong) {
  const auto error = [](const std::string& camera) {
    const auto opened = open_camera({camera});
    return opened ? Error{} : opened.error();
  };
  EXPECT_EQ(error("webcam").code, ErrorCode::kUsage);
  EXPECT_NE(error("webcam").message.find("openni, freenect, v4l2"), std::string::npos);
  EXPECT_EQ(error("replay").code, ErrorCode::kUsage);
  EXPECT_EQ(error("replay:/nowhere").code, ErrorCode::kNotFound);
  EXPECT_EQ(error("v4l2:/dev/video0").code, ErrorCode::kUsage);
  for (const CameraListing& listing : list_cameras()) {
    EXPECT_FALSE(listing.state.empty());
    if (listing.is_built) continue;
    EXPECT_NE(error(listing.driver).message.find("-dev and build again"), std::string::npos);
    EXPECT_EQ(error(listing.driver).code, ErrorCode::kUsage);
  }
}

}  // namespace
}  // namespace hm
