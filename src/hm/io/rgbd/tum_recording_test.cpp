#include <algorithm>
#include <cmath>

#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/testing/testing_recordings.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;
using namespace testing_recordings;

class TumRecording : public ::testing::Test {
 protected:
  void SetUp() override { write_small_tum(path_, 4); }
  std::unique_ptr<Recording> open(const RecordingOptions& options = {}) {
    auto recording = open_recording(path_, options);
    EXPECT_TRUE(recording) << to_string(recording.error());
    return recording ? std::move(*recording) : nullptr;
  }
  /// Poses of the frames with this between the columns.
  static void write_poses(const fs::path& path, const std::string& separator) {
    std::string text;
    for (std::size_t i = 0; i < 4; ++i) {
      const RgbdFrame frame = small_frame(i);
      const Eigen::Quaterniond q = frame.T_world_camera->quaternion();
      const Vec3& t = frame.T_world_camera->translation();
      text += stamp_text(frame.stamp);
      for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()})
        text += fmt::format("{}{:.9f}", separator, value);
      text += '\n';
    }
    ASSERT_TRUE(write_file_text(path, text));
  }
  TemporaryFolder folder_;
  fs::path path_ = folder_.path() / "recording";
};

TEST_F(TumRecording, WhatIsWrittenIsReadBackExactly) {
  const auto recording = open();
  ASSERT_TRUE(recording);
  const RecordingInfo& info = recording->info();
  EXPECT_EQ(info.kind, RecordingKind::kTumRgbd);
  EXPECT_EQ(info.frame_count, 4U);
  EXPECT_EQ(info.paired_count, 4U);
  EXPECT_EQ(info.posed_count, 4U);
  EXPECT_EQ(info.camera.fy, kSmallCamera.fy);
  EXPECT_EQ(info.camera_source, "camera.txt");
  EXPECT_TRUE(info.notes.empty()) << info.notes;
  EXPECT_TRUE(info.truth.empty());
  for (std::size_t i = 0; i < 4; ++i) {
    const RgbdFrame written = small_frame(i);
    const auto frame = recording->read(i);
    ASSERT_TRUE(frame) << to_string(frame.error());
    EXPECT_EQ(frame->index, i);
    EXPECT_EQ(frame->stamp, written.stamp);
    EXPECT_EQ(frame->color_stamp, written.color_stamp);
    EXPECT_TRUE(same_pixels(frame->depth.units, written.depth.units));
    EXPECT_DOUBLE_EQ(frame->depth.unit_m, 1.0 / 5000);
    EXPECT_TRUE(same_pixels(frame->color, written.color));
    ASSERT_TRUE(frame->T_world_camera);
    EXPECT_LT(pose_difference(*frame->T_world_camera, *written.T_world_camera), 2e-9);
    EXPECT_TRUE(is_rigid(*frame->T_world_camera));
  }
}

TEST_F(TumRecording, DepthAloneIsReadWithoutTouchingColor) {
  const auto recording = open();
  ASSERT_TRUE(recording);
  const auto whole = recording->read(2);
  ASSERT_TRUE(whole);
  fs::remove_all(path_ / "rgb");
  EXPECT_FALSE(recording->read(2));
  const auto depth = recording->read_depth(2);
  ASSERT_TRUE(depth) << to_string(depth.error());
  EXPECT_EQ(depth->index, 2U);
  EXPECT_EQ(depth->stamp, whole->stamp);
  EXPECT_EQ(depth->color_stamp, whole->color_stamp);
  EXPECT_TRUE(same_pixels(depth->depth.units, whole->depth.units));
  EXPECT_EQ(depth->depth.unit_m, whole->depth.unit_m);
  EXPECT_TRUE(depth->color.empty());
  EXPECT_EQ(depth->T_world_camera->matrix(), whole->T_world_camera->matrix());
}

TEST_F(TumRecording, DevicePosesComeBeforeGroundTruth) {
  const fs::path path = folder_.path() / "drifting";
  auto writer = TumWriter::create(path, kSmallCamera, 1000);
  ASSERT_TRUE(writer);
  Trajectory device;
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(writer->add(small_frame(i)));
    device.push_back({small_frame(i).stamp, random_pose(900 + i)});
  }
  writer->set_device_poses(device);
  ASSERT_TRUE(writer->finish());
  ASSERT_TRUE(write_file_text(path / "truth_mesh.ply", "ply\n"));
  const auto recording = open_recording(path);
  ASSERT_TRUE(recording);
  const RecordingInfo& info = (*recording)->info();
  ASSERT_EQ(info.trajectory.size(), 3U);
  ASSERT_EQ(info.truth.size(), 3U);
  EXPECT_EQ(info.trajectory_source, "poses.txt");
  EXPECT_EQ(info.truth_mesh, path / "truth_mesh.ply");
  EXPECT_LT(pose_difference(*(*recording)->read(1)->T_world_camera, device[1].T_world_base), 2e-9);
  EXPECT_LT(pose_difference(info.truth[1].T_world_base, *small_frame(1).T_world_camera), 2e-9);
  // 5000 units a metre became 1000: rounded to the nearest.
  const auto depth = (*recording)->read(0)->depth;
  EXPECT_DOUBLE_EQ(depth.unit_m, 1e-3);
  EXPECT_EQ(depth.units(3, 4), static_cast<int>(std::lround(small_frame(0).depth.units(3, 4) / 5.0)));
}

TEST_F(TumRecording, TheWriterRefusesWhatWouldBeLost) {
  EXPECT_EQ(TumWriter::create(path_, kSmallCamera).error().code, ErrorCode::kUsage);
  auto writer = TumWriter::create(folder_.path() / "w", kSmallCamera);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->add(small_frame(1)));
  EXPECT_FALSE(writer->add(small_frame(1)));
  EXPECT_FALSE(writer->add(small_frame(0)));
  ASSERT_TRUE(write_file_text(folder_.path() / "file", "x"));
  EXPECT_FALSE(TumWriter::create(folder_.path() / "file" / "below", kSmallCamera));
  EXPECT_FALSE(TumWriter::create(folder_.path() / "bad", PinholeCamera{}));
}

TEST_F(TumRecording, PosesAreInterpolatedToTheStampOfTheDepthImage) {
  // 1 m/s along x and 1 rad/s about z: at constant rates interpolation is exact.
  std::string text;
  const Time start = small_frame(0).stamp;
  const double offset_s = 0.03;
  for (int k = 0; k < 12; ++k) {
    const double t = 0.04 * k - offset_s;
    const Time stamp = start + Duration::from_seconds(t);
    text += fmt::format("{}.{:09} {} 2 3 0 0 {} {}\r\n", stamp.ns / 1000000000, stamp.ns % 1000000000, t,
                        std::sin(t / 2), std::cos(t / 2));
  }
  ASSERT_TRUE(write_file_text(path_ / "groundtruth.txt", text));
  const auto recording = open();
  for (std::size_t i = 0; i < 4; ++i) {
    const auto frame = recording->read(i);
    const double t = (frame->stamp - start).seconds();
    EXPECT_NE(frame->stamp, frame->color_stamp);
    EXPECT_LT(pose_difference(*frame->T_world_camera, SE3(so3_exp(Vec3(0, 0, t)), Vec3(t, 2, 3))), 1e-8);
  }
}

TEST_F(TumRecording, ColorIsPairedByStampAndUsedOnce) {
  // One colour image far from all, one depth image without a partner.
  const auto stamp = [](Time t) { return fmt::format("{}.{:09}", t.ns / 1000000000, t.ns % 1000000000); };
  std::string rgb;
  for (std::size_t i : {0U, 1U, 3U}) {
    const RgbdFrame f = small_frame(i);
    rgb += fmt::format("{} rgb/{}.png\n", stamp(i == 1 ? f.stamp + Duration{15'000'000} : f.stamp),
                       stamp(f.color_stamp));
  }
  ASSERT_TRUE(write_file_text(path_ / "rgb.txt", rgb));
  const auto recording = open();
  EXPECT_EQ(recording->info().paired_count, 3U);
  EXPECT_TRUE(same_pixels(recording->read(1)->color, small_frame(1).color));
  EXPECT_TRUE(recording->read(2)->color.empty());
  const auto strict = open({.max_stamp_difference_s = 0.01});
  EXPECT_EQ(strict->info().paired_count, 2U);
}

TEST_F(TumRecording, OneBadPictureCostsOneFrame) {
  const auto name = [](std::size_t i, bool color) {
    const Time t = color ? small_frame(i).color_stamp : small_frame(i).stamp;
    return fmt::format("{}/{}.{:09}.png", color ? "rgb" : "depth", t.ns / 1000000000, t.ns % 1000000000);
  };
  fs::remove(path_ / name(0, false));
  ASSERT_TRUE(write_file_text(path_ / name(1, true), "\x89PNG"));
  ASSERT_TRUE(write_png(path_ / name(2, false), Image<std::uint16_t>(5, 5, 7)));
  const auto recording = open();
  EXPECT_EQ(recording->info().missing_images, 1U);
  EXPECT_EQ(recording->info().first_missing_image, name(0, false));
  EXPECT_EQ(recording->read(0).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(recording->read(0).error().where, path_ / name(0, false));
  EXPECT_EQ(recording->read(1).error().where, path_ / name(1, true));
  EXPECT_EQ(recording->read(2).error().message, "is 5 x 5, the recording's camera 24 x 16");
  EXPECT_TRUE(recording->read(3));
}

TEST_F(TumRecording, OptionsComeBeforeFiles) {
  PinholeCamera other = kSmallCamera;
  other.fx = 33;
  const auto recording = open({.camera = other, .depth_units_per_m = 1000});
  EXPECT_EQ(recording->info().camera.fx, 33);
  EXPECT_EQ(recording->info().camera_source, "given");
  EXPECT_DOUBLE_EQ(recording->read(0)->depth.unit_m, 1e-3);
  EXPECT_FALSE(open_recording(path_, {.camera = PinholeCamera{}}));
  const auto unscaled = open_recording(path_, {.depth_units_per_m = 0});
  ASSERT_FALSE(unscaled);
  EXPECT_EQ(unscaled.error().where, "--depth-units-per-m");
  EXPECT_EQ(unscaled.error().code, ErrorCode::kUsage);
  EXPECT_FALSE(open_recording(path_, {.kind = RecordingKind::kSevenScenes}));
}

TEST_F(TumRecording, PosesThatCannotBeReadAreNoErrorAndSaid) {
  ASSERT_TRUE(write_file_text(path_ / "groundtruth.txt", "1 2 3 4\n"));
  const auto positions = open();
  EXPECT_EQ(positions->info().frame_count, 4U);
  EXPECT_EQ(positions->info().posed_count, 0U);
  EXPECT_TRUE(positions->info().trajectory.empty());
  EXPECT_NE(positions->info().poses_unreadable.find("groundtruth.txt:1: 4 columns"), std::string::npos);
  // The truth does not take the place of poses of the device that cannot be read.
  write_poses(path_ / "groundtruth.txt", " ");
  ASSERT_TRUE(write_file_text(path_ / "poses.txt", "x 0 0 0 0 0 0 1\n"));
  const auto device = open();
  EXPECT_EQ(device->info().posed_count, 0U);
  EXPECT_TRUE(device->info().trajectory_source.empty());
  EXPECT_EQ(device->info().truth.size(), 4U);
  EXPECT_NE(device->info().poses_unreadable.find("poses.txt:1"), std::string::npos);
}

TEST_F(TumRecording, PosesWithCommasAndListsOfWindowsAreRead) {
  write_poses(path_ / "groundtruth.txt", ",");
  for (const char* list : {"depth.txt", "rgb.txt"}) {
    std::string text = file_text(path_ / list);
    std::ranges::replace(text, '/', '\\');
    ASSERT_TRUE(write_file_text(path_ / list, text));
  }
  const auto recording = open();
  EXPECT_TRUE(recording->info().poses_unreadable.empty()) << recording->info().poses_unreadable;
  EXPECT_EQ(recording->info().posed_count, 4U);
  EXPECT_EQ(recording->info().missing_images, 0U);
  EXPECT_EQ(recording->info().paired_count, 4U);
  EXPECT_LT(pose_difference(recording->info().trajectory[1].T_world_base, *small_frame(1).T_world_camera),
            2e-9);
}

TEST_F(TumRecording, IntrinsicsOfAnotherSizeAreScaledOrRefused) {
  ASSERT_TRUE(write_file_text(path_ / "camera.txt", "width 48\nheight 32\nfx 40\nfy 42\ncx 23.5\ncy 15.5\n"));
  const auto recording = open();
  EXPECT_EQ(recording->info().camera.width, 24);
  EXPECT_EQ(recording->info().camera.fx, 20);
  EXPECT_EQ(recording->info().camera.cx, 11.5);
  EXPECT_NE(recording->info().notes.find("scaled"), std::string::npos);
  ASSERT_TRUE(write_file_text(path_ / "camera.txt", "width 48\nheight 31\nfx 40\nfy 42\ncx 23.5\ncy 15.5\n"));
  EXPECT_EQ(open_recording(path_).error().code, ErrorCode::kInvalidValue);
}

TEST_F(TumRecording, WithoutIntrinsicsTheNameOrTheListsTellOrItIsAnError) {
  fs::remove(path_ / "camera.txt");
  const auto unknown = open_recording(path_);
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find("camera.txt"), std::string::npos);
  ASSERT_TRUE(write_file_text(path_ / "camera-intrinsics.txt", "20 0 11.5\n0 21 7.5\n0 0 1\n"));
  EXPECT_EQ(open()->info().camera.width, 24);
  EXPECT_EQ(open()->info().camera_source, "camera-intrinsics.txt");
  fs::remove(path_ / "camera-intrinsics.txt");
  ASSERT_TRUE(write_file_text(
      path_ / "depth.txt", "# file: 'rgbd_dataset_freiburg2_desk.bag'\n" + file_text(path_ / "depth.txt")));
  const auto known = open_recording(path_);
  ASSERT_FALSE(known);  // fr2 is 4:3, these images are 3:2
  EXPECT_NE(known.error().message.find("640 x 480"), std::string::npos);
  EXPECT_NE(known.error().message.find("TUM's camera of `rgbd_dataset_freiburg2_desk.bag`"),
            std::string::npos);
}

TEST_F(TumRecording, GivenIntrinsicsWithoutASizeAreForTheImages) {
  PinholeCamera given = kSmallCamera;
  given.width = given.height = 0;
  EXPECT_EQ(open({.camera = given})->info().camera.width, 24);
  EXPECT_EQ(open({.camera = given})->info().camera.height, 16);
  given.cx = 23.5, given.cy = 15.5;  // of 48 x 32
  const auto larger = open_recording(path_, {.camera = given});
  ASSERT_FALSE(larger);
  EXPECT_NE(larger.error().message.find("depth images of 24 x 16"), std::string::npos);
  EXPECT_NE(larger.error().message.find("--size"), std::string::npos);
  given.width = 64, given.height = 48;
  const auto another = open_recording(path_, {.camera = given});
  ASSERT_FALSE(another);
  EXPECT_NE(another.error().message.find("--size 24 16"), std::string::npos);
}

TEST_F(TumRecording, AnAssumedUnitOfDepthIsSaid) {
  EXPECT_TRUE(open()->info().assumptions.empty());  // its camera.txt has a depth_scale
  ASSERT_TRUE(write_file_text(path_ / "camera.txt", "width 24\nheight 16\nfx 20\nfy 21\ncx 11.5\ncy 7.5\n"));
  const auto recording = open();
  ASSERT_EQ(recording->info().assumptions.size(), 1U);
  EXPECT_NE(recording->info().assumptions[0].find("--depth-units-per-m 1000"), std::string::npos);
  EXPECT_DOUBLE_EQ(recording->info().depth_unit_m, 1.0 / 5000);
  EXPECT_TRUE(open({.depth_units_per_m = 5000})->info().assumptions.empty());
  for (const char* list : {"depth.txt", "rgb.txt", "associations.txt"})
    fs::remove(path_ / list);  // read by the images' names
  const auto named = open();
  EXPECT_DOUBLE_EQ(named->info().depth_unit_m, 1e-3);
  ASSERT_EQ(named->info().assumptions.size(), 1U);
  EXPECT_NE(named->info().assumptions[0].find("taken as 1000 units per metre"), std::string::npos);
  EXPECT_NE(named->info().assumptions[0].find("--depth-units-per-m 5000"), std::string::npos);
  EXPECT_TRUE(open({.depth_units_per_m = 1000})->info().assumptions.empty());
  const auto realsense = open_recording(path_, {.depth_units_per_m = 0.001});
  ASSERT_FALSE(realsense);
  EXPECT_EQ(realsense.error().code, ErrorCode::kUsage);
  EXPECT_NE(realsense.error().message.find("write 1000 (units per metre)"), std::string::npos);
}

TEST_F(TumRecording, TheCameraOfAnotherProgramIsUsedUnlessOneIsNamed) {
  const std::string open3d =
      R"({"width": 24, "height": 16, "depth_scale": 1000, "intrinsic_matrix": [20, 0, 0, 0, 21, 0, 11.5, 7.5, 1]})";
  ASSERT_TRUE(write_file_text(path_ / "intrinsic.json", open3d));
  EXPECT_EQ(open()->info().camera_source, "camera.txt");
  fs::remove(path_ / "camera.txt");
  EXPECT_EQ(open()->info().camera.fy, 21);
  EXPECT_EQ(open()->info().camera_source, "intrinsic.json");
  EXPECT_DOUBLE_EQ(open()->info().depth_unit_m, 1e-3);
  EXPECT_TRUE(open()->info().assumptions.empty());
  ASSERT_TRUE(write_file_text(path_ / "intrinsic.json", "{"));
  const auto damaged = open_recording(path_);
  ASSERT_FALSE(damaged);
  EXPECT_NE(to_string(damaged.error()).find("intrinsic.json"), std::string::npos);
  EXPECT_NE(open({.camera = kSmallCamera})->info().notes.find("intrinsic.json"), std::string::npos);
}

TEST_F(TumRecording, InvalidDepthAndOtherSizesOfColor) {
  RgbdFrame frame = small_frame(0);
  frame.depth.units(2, 3) = 65535;
  const fs::path path = folder_.path() / "sizes";
  auto writer = TumWriter::create(path, kSmallCamera);
  ASSERT_TRUE(writer->add(frame));
  ASSERT_TRUE(writer->finish());
  const auto big = random_color(72, 48, 9);
  for (const auto& entry : fs::directory_iterator(path / "rgb")) ASSERT_TRUE(write_png(entry.path(), big));
  const auto read = (*open_recording(path))->read(0);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->depth.units(2, 3), 0);
  EXPECT_EQ(read->depth.units(3, 3), frame.depth.units(3, 3));
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 24; ++x) ASSERT_EQ(read->color(x, y), big(3 * x + 1, 3 * y + 1));
}

TEST(OpenRecording, SaysWhatItLookedFor) {
  const TemporaryFolder folder;
  const auto nothing = open_recording(folder.path());
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, ErrorCode::kNotFound);
  EXPECT_NE(nothing.error().message.find("depth.txt"), std::string::npos);
  EXPECT_NE(nothing.error().message.find("frame-XXXXXX.depth.png"), std::string::npos);
  EXPECT_EQ(open_recording(folder.path() / "none").error().code, ErrorCode::kNotFound);
  ASSERT_TRUE(write_file_text(folder.path() / "file", "x"));
  EXPECT_EQ(open_recording(folder.path() / "file").error().code, ErrorCode::kUnsupported);
}

}  // namespace
}  // namespace hm
