#include "hm/cameras/v4l2_camera.hpp"

#include <gmock/gmock.h>
#include <linux/videodev2.h>

#include <cstring>
#include <thread>

#include "hm/cameras/live_source.hpp"
#include "hm/cameras/testing/fake_video_device.hpp"
#include "hm/cameras/testing/testing_frames.hpp"
#include "hm/cameras/yuv.hpp"
#include "hm/io/image/image_file.hpp"

namespace hm {
namespace {

using Kind = CameraEvent::Kind;
using std::chrono::milliseconds;
using testing_frames::FakeVideoDevice;
using testing_frames::kHeight;
using testing_frames::kWidth;
using Bytes = std::vector<std::byte>;

/// Rows of a depth device are padded to this.
constexpr std::size_t kDepthRow = 2 * kWidth + 16;

Bytes depth_bytes(int number) {
  const DepthImage depth = testing_frames::depth_image(number);
  Bytes bytes(kDepthRow * kHeight, std::byte{0xee});
  for (int y = 0; y < kHeight; ++y)
    std::memcpy(bytes.data() + static_cast<std::size_t>(y) * kDepthRow, depth.units.row(y).data(),
                2 * kWidth);
  return bytes;
}

/// A grey image whose brightness is the number.
Bytes yuyv_bytes(int luma) {
  Bytes bytes(2 * kWidth * kHeight, std::byte{128});
  for (std::size_t i = 0; i < bytes.size(); i += 2) bytes[i] = static_cast<std::byte>(luma);
  return bytes;
}

struct TwoFeeds {
  std::shared_ptr<FakeVideoDevice::Feed> depth = std::make_shared<FakeVideoDevice::Feed>(),
                                         color = std::make_shared<FakeVideoDevice::Feed>();
};

VideoDevices devices(const TwoFeeds& feeds, bool by_read, std::uint32_t color_format = V4L2_PIX_FMT_YUYV) {
  const FakeVideoDevice::Setup depth{V4L2_PIX_FMT_Z16,    kWidth, kHeight, kDepthRow,
                                     kDepthRow * kHeight, by_read};
  const std::size_t row = color_format == V4L2_PIX_FMT_YUYV ? 2 * kWidth : 0;
  const FakeVideoDevice::Setup color{color_format, kWidth, kHeight, row, 2 * kWidth * kHeight * 4, by_read};
  FakeVideoDevice::Setup exact = color;
  if (row > 0) exact.image_bytes = row * kHeight;
  return {std::make_unique<FakeVideoDevice>(depth, feeds.depth),
          std::make_unique<FakeVideoDevice>(exact, feeds.color)};
}

CameraRequest request() { return {.camera = "v4l2", .intrinsics = testing_frames::kCamera}; }

std::unique_ptr<CameraDriver> open(const TwoFeeds& feeds, bool by_read,
                                   std::uint32_t color_format = V4L2_PIX_FMT_YUYV) {
  auto camera = open_v4l2(devices(feeds, by_read, color_format), request());
  EXPECT_TRUE(camera) << to_string(camera.error());
  return std::move(*camera);
}

/// The next frame, failure or incomplete image, whatever comes first.
CameraEvent next(CameraDriver& camera) {
  for (int i = 0; i < 100; ++i)
    if (CameraEvent event = camera.next(milliseconds(50)); event.kind != Kind::kTimeout) return event;
  return {};
}

TEST(V4l2Camera, BuffersGiveDepthAndColourWithTheDevicesStamps) {
  const TwoFeeds feeds;
  const auto camera = open(feeds, false);
  EXPECT_TRUE(feeds.depth->is_streaming);
  EXPECT_THAT(camera->describe().name, testing::HasSubstr("fake camera"));
  std::vector<Time> stamps;
  for (int i = 0; i < 10; ++i) {  // more than there are buffers
    feeds.depth->give(depth_bytes(i), 1'000'000 + 33'333 * i);
    feeds.color->give(yuyv_bytes(20 + i), 1'000'000 + 33'333 * i + 4'000);
    const CameraEvent event = next(*camera);
    ASSERT_EQ(event.kind, Kind::kFrame) << event.reason;
    EXPECT_TRUE(
        std::ranges::equal(event.frame.depth.units.pixels(), testing_frames::depth_image(i).units.pixels()));
    EXPECT_EQ((event.frame.color_stamp - event.frame.stamp).ns, 4'000'000);
    EXPECT_NEAR(event.frame.color(3, 3).g, 1.164 * (4 + i), 1);
    stamps.push_back(event.frame.stamp);
  }
  EXPECT_EQ((stamps[9] - stamps[0]).ns, 9 * 33'333'000);
}

TEST(V4l2Camera, APipeGivesImagesInPieces) {
  const TwoFeeds feeds;
  const auto camera = open(feeds, true);
  std::thread feeder([&] {
    for (int i = 0; i < 5; ++i) {
      const Bytes depth = depth_bytes(i), color = yuyv_bytes(40 + i);
      const auto half = static_cast<std::ptrdiff_t>(depth.size() / 2);
      feeds.depth->give(Bytes(depth.begin(), depth.begin() + half), 0);
      std::this_thread::sleep_for(milliseconds(2));
      feeds.depth->give(Bytes(depth.begin() + half, depth.end()), 0);
      feeds.color->give(color, 0);
      std::this_thread::sleep_for(milliseconds(40));  // read() has no stamps but the computer's own
    }
    feeds.depth->give(Bytes(100), 0);
    feeds.depth->unplug();
  });
  int frames = 0;
  CameraEvent event = next(*camera);
  for (; event.kind == Kind::kFrame; event = next(*camera)) {
    EXPECT_EQ(event.frame.depth.units(7, 7), testing_frames::depth_image(frames).units(7, 7));
    ++frames;
  }
  feeder.join();
  EXPECT_EQ(frames, 5);
  EXPECT_EQ(event.kind, Kind::kFailed);
  EXPECT_THAT(event.reason, testing::HasSubstr("ended after 100 of"));
}

TEST(V4l2Camera, MjpegIsDecoded) {
  const TwoFeeds feeds;
  const auto camera = open(feeds, false, V4L2_PIX_FMT_MJPEG);
  const auto jpeg = encode_jpeg(Image<Rgb8>(kWidth, kHeight, {200, 100, 50}), 95);
  Bytes bytes(jpeg.size());
  std::memcpy(bytes.data(), jpeg.data(), jpeg.size());
  feeds.depth->give(depth_bytes(1), 1'000'000);
  feeds.color->give(bytes, 1'000'000);
  const CameraEvent event = next(*camera);
  ASSERT_EQ(event.kind, Kind::kFrame) << event.reason;
  EXPECT_NEAR(event.frame.color(5, 5).r, 200, 4);
  EXPECT_NEAR(event.frame.color(5, 5).b, 50, 4);
}

TEST(V4l2Camera, DamagedAndShortImagesAreNamedAndTheRestGoesOn) {
  const TwoFeeds feeds;
  const auto camera = open(feeds, false);
  feeds.depth->give(depth_bytes(0), 1'000'000, true);
  EXPECT_EQ(next(*camera).kind, Kind::kIncomplete);
  feeds.depth->give(Bytes(77), 1'033'000);
  const CameraEvent event = next(*camera);
  EXPECT_EQ(event.kind, Kind::kIncomplete);
  EXPECT_THAT(event.reason, testing::HasSubstr("77 bytes"));
  feeds.depth->give(depth_bytes(2), 1'066'000);
  feeds.color->give(yuyv_bytes(9), 1'066'000);
  EXPECT_EQ(next(*camera).kind, Kind::kFrame);
}

TEST(V4l2Camera, UnpluggedIsAFailureWithItsReason) {
  const TwoFeeds feeds;
  const auto camera = open(feeds, false);
  feeds.color->unplug();
  const CameraEvent event = next(*camera);
  EXPECT_EQ(event.kind, Kind::kFailed);
  EXPECT_THAT(event.reason, testing::HasSubstr("the device is gone"));
}

TEST(V4l2Camera, ExposureIsLockedOnceItHasSettled) {
  const TwoFeeds feeds;
  feeds.color->controls = {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY},
                           {V4L2_CID_EXPOSURE_ABSOLUTE, 156},
                           {V4L2_CID_AUTO_WHITE_BALANCE, 1}};
  const auto camera = open(feeds, false);
  EXPECT_EQ(camera->describe().exposure, ExposureControl::kAutomatic);
  for (int i = 0; i < 31; ++i) {
    feeds.depth->give(depth_bytes(i), 1'000'000 + 33'333 * i);
    feeds.color->give(yuyv_bytes(i), 1'000'000 + 33'333 * i);
    ASSERT_EQ(next(*camera).kind, Kind::kFrame);
  }
  EXPECT_EQ(camera->describe().exposure, ExposureControl::kLocked);
  EXPECT_EQ(feeds.color->controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(feeds.color->controls[V4L2_CID_EXPOSURE_ABSOLUTE], 156) << "as the camera had found it";
  EXPECT_EQ(feeds.color->controls[V4L2_CID_AUTO_WHITE_BALANCE], 0);
}

/// The device keeps its settings when it is closed.
TEST(V4l2Camera, ExposureAdaptsAnewInTheNextScan) {
  const TwoFeeds feeds;
  feeds.color->controls = {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL}, {V4L2_CID_AUTO_WHITE_BALANCE, 0}};
  const auto camera = open(feeds, false);
  EXPECT_EQ(feeds.color->controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_APERTURE_PRIORITY);
  EXPECT_EQ(feeds.color->controls[V4L2_CID_AUTO_WHITE_BALANCE], 1);
}

TEST(V4l2Camera, RefusesWhatItCannotUse) {
  const TwoFeeds one, two, three;
  const auto without = open_v4l2(devices(one, false), {.camera = "v4l2"});
  ASSERT_FALSE(without);
  EXPECT_EQ(without.error().code, ErrorCode::kUsage);
  EXPECT_THAT(without.error().message, testing::HasSubstr("--calibration"));
  VideoDevices swapped = devices(two, false);
  std::swap(swapped.depth, swapped.color);
  const auto wrong = open_v4l2(std::move(swapped), request());
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, testing::HasSubstr("does not give Z16"));
  CameraRequest other = request();
  other.intrinsics->width = 640;
  EXPECT_FALSE(open_v4l2(devices(three, false), other));
}

/// A device that ends in the middle, all the way to the consumer: no frame is lost without being counted.
TEST(V4l2Camera, ThroughALiveSource) {
  const TwoFeeds feeds;
  LiveSource source(open(feeds, true), {});
  std::thread feeder([&] {
    for (int i = 0; i < 6; ++i) {
      feeds.depth->give(depth_bytes(i), 0);
      feeds.color->give(yuyv_bytes(i), 0);
      std::this_thread::sleep_for(milliseconds(40));
    }
    feeds.color->unplug();
  });
  std::size_t taken = 0;
  while (source.end() == CaptureEnd::kRunning)
    if (source.next(milliseconds(100))) ++taken;
  feeder.join();
  EXPECT_EQ(source.end(), CaptureEnd::kFailed);
  const CaptureCounts counts = source.counts();
  EXPECT_EQ(counts.captured, taken + counts.dropped_in_all());
  EXPECT_GE(counts.captured, 5U);
}

TEST(Yuv, KnownColours) {
  const auto color_of = [](int y, int u, int v) {
    const Bytes bytes{std::byte(y), std::byte(u), std::byte(y), std::byte(v)};
    return yuyv_to_rgb(bytes, 2, 1, 4)(1, 0);
  };
  EXPECT_EQ(color_of(16, 128, 128), (Rgb8{0, 0, 0}));
  EXPECT_EQ(color_of(235, 128, 128), (Rgb8{255, 255, 255}));
  EXPECT_EQ(color_of(81, 90, 240), (Rgb8{254, 0, 0}));  // BT.601's red, green and blue
  EXPECT_EQ(color_of(145, 54, 34), (Rgb8{0, 255, 1}));
  EXPECT_EQ(color_of(41, 240, 110), (Rgb8{0, 0, 255}));
  EXPECT_EQ(color_of(255, 255, 255), (Rgb8{255, 125, 255})) << "clamped";
}

}  // namespace
}  // namespace hm
