#include "hm/pipeline/checks/recording_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/rgbd/tum_writer.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/pipeline/checks/color_registration_fit.hpp"
#include "hm/pipeline/checks/color_shift.hpp"
#include "hm/pipeline/checks/pose_agreement.hpp"
#include "hm/pipeline/checks/preflight.hpp"
#include "hm/pipeline/checks/recording_check_test_support.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;
using namespace recording_check_test;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const PinholeCamera kCamera{160, 120, 140.0, 141.0, 79.5, 59.5, {}};

/// A box room of 4 x 3 x 5 m around the origin with a ball in it: depth in closed form.
struct RoomHit {
  double depth_m = 0;
  int surface = 0;
};
RoomHit look_at_room(const SE3& T_world_camera, const Vec3& ray_camera) {
  const Vec3 half(2.0, 1.5, 2.5), centre(0.4, 0.3, 1.2);
  const Vec3 o = T_world_camera.translation(), d = T_world_camera.rotation() * ray_camera;
  RoomHit hit{1e9, 0};
  for (int axis = 0; axis < 3; ++axis) {
    const double t = ((d[axis] > 0 ? half[axis] : -half[axis]) - o[axis]) / d[axis];
    if (t > 0 && t < hit.depth_m) hit = {t, 1 + 2 * axis + (d[axis] > 0 ? 1 : 0)};
  }
  const Vec3 to_ball = o - centre;
  const double a = d.squaredNorm(), b = to_ball.dot(d), c = to_ball.squaredNorm() - 0.4 * 0.4;
  if (const double root = b * b - a * c; root > 0 && (-b - std::sqrt(root)) / a > 0)
    hit = {(-b - std::sqrt(root)) / a, 7};
  return hit;
}

/// A walk with turns in all directions.
SE3 pose_at_frame(int i) {
  const double s = 0.1 * i;
  return {so3_exp(Vec3(0.15 * std::sin(s), 0.3 * std::sin(0.7 * s), 0.1 * std::sin(1.3 * s))),
          Vec3(0.5 * std::sin(0.5 * s), 0.25 * std::cos(0.8 * s), 0.4 * std::sin(0.3 * s))};
}

struct RoomOptions {
  int color_right_px = 0;
  double color_scale_ratio = 1;  ///< about the image's middle
  double color_left_m = 0;       ///< of the colour camera, beside the depth camera
  bool invert_poses = false;
  int frames = 60;
};

void write_room(const fs::path& folder, const RoomOptions& options = {}) {
  auto writer = TumWriter::create(folder, kCamera, 5000);
  ASSERT_TRUE(writer);
  Rng rng(4);
  const Vec2 middle((kCamera.width - 1) / 2.0, (kCamera.height - 1) / 2.0), shift(options.color_right_px, 0);
  for (int i = 0; i < options.frames; ++i) {
    const SE3 pose = pose_at_frame(i);
    const SE3 color_pose = pose * SE3(Mat3::Identity(), Vec3(-options.color_left_m, 0, 0));
    RgbdFrame frame;
    frame.stamp = frame.color_stamp = Time{1'000'000'000'000 + 33'333'333LL * i};
    frame.depth = {Image<std::uint16_t>(kCamera.width, kCamera.height), 1.0 / 5000};
    frame.color = Image<Rgb8>(kCamera.width, kCamera.height);
    for (int y = 0; y < kCamera.height; ++y)
      for (int x = 0; x < kCamera.width; ++x) {
        const double depth_m = look_at_room(pose, kCamera.unproject(Vec2(x, y), 1.0)).depth_m;
        frame.depth.units(x, y) = static_cast<std::uint16_t>((depth_m + rng.normal(0, 0.004)) * 5000);
        const int seen =
            look_at_room(
                color_pose,
                kCamera.unproject(middle + (Vec2(x, y) - shift - middle) / options.color_scale_ratio, 1.0))
                .surface;
        frame.color(x, y) = {static_cast<std::uint8_t>(30 * seen), static_cast<std::uint8_t>(255 - 30 * seen),
                             90};
      }
    frame.T_world_camera = options.invert_poses ? pose.inverse() : pose;
    ASSERT_TRUE(writer->add(frame));
  }
  ASSERT_TRUE(writer->finish());
}

std::string file_text(const fs::path& path) {
  const auto bytes = read_file_bytes(path);
  EXPECT_TRUE(bytes);
  return std::string(bytes->begin(), bytes->end());
}

/// A written room, shared by the tests that only read it or replace its text files.
class RoomCheck : public ::testing::Test {
 protected:
  void SetUp() override { write_room(path_); }
  TemporaryFolder folder_;
  fs::path path_ = folder_.path() / "room";
};

TEST_F(RoomCheck, NothingIsFoundInAGoodRecording) {
  const RecordingReport report = inspect(path_);
  EXPECT_THAT(report.findings, IsEmpty()) << messages(report);
  EXPECT_EQ(report.pairs_compared, 12U);
  ASSERT_FALSE(report.agreement.empty());
  EXPECT_EQ(report.agreement[0].hypothesis, "as given");
  // Two readings with 4 mm of noise each, and the slope of the walls over half a pixel.
  EXPECT_GT(report.agreement[0].agreement_mm, 2.0);
  EXPECT_LT(report.agreement[0].agreement_mm, 9.0);
  ASSERT_EQ(report.streams.size(), 3U);
  EXPECT_EQ(report.streams[0].count, 60U);
  EXPECT_NEAR(report.streams[0].rate_hz, 30.0, 1e-3);
  EXPECT_NEAR(report.streams[0].duration_s, 59 / 30.0, 1e-3);
  EXPECT_EQ(report.streams[0].gaps, 0U);
  EXPECT_NEAR(report.depth.valid_ratio, 1.0, 1e-9);
  double length_m = 0;
  for (int i = 1; i < 60; ++i)
    length_m += (pose_at_frame(i).translation() - pose_at_frame(i - 1).translation()).norm();
  EXPECT_NEAR(report.path_length_m, length_m, 0.01 * length_m);  // steps under 2 cm are joined
}

TEST_F(RoomCheck, TheInertialDeviceIsNamedAndItsHolesAreFound) {
  std::string lines;
  for (int i = 0; i < 400; ++i)
    if (i < 100 || i >= 250) lines += fmt::format("{:.3f} 0.1 -0.2 9.8{:03}\n", 1000.0 + 0.005 * i, i);
  ASSERT_TRUE(write_file_text(path_ / "accelerometer.txt", lines));
  const RecordingReport report = inspect(path_);
  ASSERT_EQ(report.streams.size(), 4U);
  EXPECT_EQ(report.streams[3].name, "imu");
  EXPECT_EQ(report.streams[3].count, 250U);
  EXPECT_NEAR(report.streams[3].rate_hz, 200.0, 0.1);
  EXPECT_THAT(messages(report), HasSubstr("imu: 1 gap, the longest 0.76 s"));
  EXPECT_THAT(to_text(report), HasSubstr("accelerometer.txt: accelerometer only"));
  EXPECT_EQ(to_json(report).find("imu")->find("has_gyroscope")->as_bool()[0], false);
}

TEST_F(RoomCheck, DepthStatisticsMatchTheImages) {
  const RecordingReport report = inspect(path_);
  double low = 1e9, high = 0;
  const auto recording = open_recording(path_);
  for (std::size_t i = 0; i < 60; ++i) {
    const auto frame = (*recording)->read(i);
    ASSERT_TRUE(frame);
    for (const std::uint16_t units : frame->depth.units.pixels()) {
      low = std::min(low, units / 5000.0);
      high = std::max(high, units / 5000.0);
    }
  }
  EXPECT_GE(report.depth.min_m, low);
  EXPECT_LT(report.depth.min_m, low + 0.3);
  EXPECT_LE(report.depth.max_m, high);
  EXPECT_GT(report.depth.max_m, high - 0.3);
  EXPECT_GT(report.depth.median_m, report.depth.p05_m);
  EXPECT_GT(report.depth.p95_m, report.depth.median_m);
}

TEST_F(RoomCheck, DepthScaleOffIsFoundWithTheRightFactor) {
  for (const double units_per_m : {500.0, 1000.0, 50000.0, 25000.0, 10000.0, 900.0, 7000.0}) {
    const RecordingReport report = inspect(path_, {.depth_units_per_m = units_per_m});
    EXPECT_THAT(kinds(report), ::testing::Contains(FindingKind::kDepthScale)) << units_per_m;
    EXPECT_THAT(messages(report),
                HasSubstr(fmt::format("5000 units per metre instead of {:.6g}", units_per_m)));
    EXPECT_THAT(messages(report), HasSubstr(" mm ("));
  }
}

TEST_F(RoomCheck, WrongSignOfFyIsFound) {
  PinholeCamera flipped = kCamera;
  flipped.fy = -flipped.fy;
  const RecordingReport report = inspect(path_, {.camera = flipped});
  EXPECT_THAT(kinds(report), ElementsAre(FindingKind::kFlippedFy));
  EXPECT_THAT(messages(report), HasSubstr("fy seems to be 141 instead of -141"));
}

TEST_F(RoomCheck, TwoFaultsAtOnce) {
  PinholeCamera flipped = kCamera;
  flipped.fy = -flipped.fy;
  const RecordingReport report = inspect(path_, {.camera = flipped, .depth_units_per_m = 1000});
  EXPECT_THAT(messages(report), HasSubstr("fy seems to be 141 instead of -141"));
  EXPECT_THAT(messages(report), HasSubstr("5000 units per metre instead of 1000"));
}

TEST_F(RoomCheck, InvertedPosesAreFound) {
  const fs::path path = folder_.path() / "inverted";
  write_room(path, {.invert_poses = true});
  const RecordingReport report = inspect(path);
  EXPECT_THAT(kinds(report), ElementsAre(FindingKind::kInvertedPoses)) << messages(report);
}

TEST_F(RoomCheck, PosesInMillimetresAreNotTakenForAnotherDepthScale) {
  change_poses(path_, [](StampedPose pose) {
    return StampedPose{pose.stamp, {pose.T_world_base.rotation(), 1000 * pose.T_world_base.translation()}};
  });
  const RecordingReport report = inspect(path_);
  EXPECT_THAT(kinds(report), ElementsAre(FindingKind::kPoseUnit)) << messages(report);
  EXPECT_THAT(messages(report), HasSubstr("the poses seem to be in millimetres instead of metres"));
  EXPECT_THAT(messages(report), HasSubstr(fmt::format("path is {:.1f} m long", report.path_length_m)));
  EXPECT_GT(report.path_length_m, 100);
  auto recording = open_recording(path_);
  ASSERT_TRUE(recording);
  EXPECT_FALSE(check_before_run(*recording, {}));
  const auto forced = check_before_run(*recording, {.force = true});
  ASSERT_TRUE(forced);
  EXPECT_THAT(forced->doubts, ElementsAre(HasSubstr("millimetres")));
  const auto own = check_before_run(*recording, {.poses = PoseUse::kComparesWith});
  ASSERT_TRUE(own);
  EXPECT_THAT(own->warnings, ElementsAre(HasSubstr("millimetres")));
  EXPECT_THAT(own->doubts, IsEmpty());
}

TEST_F(RoomCheck, QuaternionsInTheOtherOrderAreFound) {
  change_poses(path_, [](StampedPose pose) {
    const Eigen::Quaterniond q = pose.T_world_base.quaternion();
    return StampedPose{pose.stamp,
                       {Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), pose.T_world_base.translation()}};
  });
  const RecordingReport report = inspect(path_);
  EXPECT_THAT(kinds(report), ElementsAre(FindingKind::kQuaternionOrder)) << messages(report);
  EXPECT_THAT(messages(report), HasSubstr("qw qx qy qz instead of qx qy qz qw"));
  auto recording = open_recording(path_);
  ASSERT_TRUE(recording);
  EXPECT_FALSE(check_before_run(*recording, {}));
  EXPECT_TRUE(check_before_run(*recording, {.poses = PoseUse::kComparesWith}));
}

TEST_F(RoomCheck, PosesThatCannotBeReadAreNamed) {
  ASSERT_TRUE(write_file_text(path_ / "groundtruth.txt", "1000.0 1 2 3\n"));
  const RecordingReport report = inspect(path_);
  EXPECT_THAT(kinds(report), ElementsAre(FindingKind::kMissingPoses)) << messages(report);
  EXPECT_THAT(messages(report), HasSubstr("groundtruth.txt:1: 4 columns: positions without orientations"));
  auto recording = open_recording(path_);
  const auto own = check_before_run(*recording, {.poses = PoseUse::kComparesWith});
  ASSERT_TRUE(own);
  EXPECT_THAT(own->warnings, ElementsAre(HasSubstr("groundtruth.txt:1")));
}

TEST_F(RoomCheck, ImagesThatCannotBeReadHaveNoDepths) {
  for (const auto& entry : fs::directory_iterator(path_ / "depth"))
    fs::resize_file(entry.path(), fs::file_size(entry.path()) / 2);
  const std::string text = to_text(inspect(path_));
  EXPECT_THAT(text, HasSubstr("not one frame could be read"));
  EXPECT_THAT(text, ::testing::Not(HasSubstr("median")));
}

TEST_F(RoomCheck, StampsThatAreNoSecondsAreAskedFor) {
  for (const char* list : {"depth.txt", "rgb.txt"}) {
    std::string text;
    for (int i = 0; i < 60; ++i) {
      const fs::path image = nth_image(path_ / (list[0] == 'd' ? "depth" : "rgb"), i);
      text += fmt::format("{} {}\n", 33 * i, image.lexically_relative(path_).string());
    }
    ASSERT_TRUE(write_file_text(path_ / list, text));
  }
  EXPECT_THAT(messages(inspect(path_)),
              HasSubstr("depth: by its stamps one comes every 33 s: are they seconds?"));
}

TEST_F(RoomCheck, WithoutPosesItLooksRight) {
  fs::remove(path_ / "groundtruth.txt");
  const RecordingReport report = inspect(path_);
  EXPECT_THAT(report.findings, IsEmpty()) << messages(report);
  EXPECT_THAT(to_text(report), HasSubstr("none: `hm slam` or `hm odometry` estimates them"));
  EXPECT_THAT(to_text(report), HasSubstr("looks right"));
}

TEST_F(RoomCheck, PosesOfAnotherClockAreNotMissing) {
  change_poses(path_, [](StampedPose pose) {
    return StampedPose{pose.stamp + Duration::from_seconds(5000), pose.T_world_base};
  });
  EXPECT_THAT(messages(inspect(path_)), HasSubstr("an offset of 5000.000 s: no common clock"));
  EXPECT_THAT(messages(inspect(path_)), HasSubstr("at most 0.15 s apart"));
  for (const char* list : {"depth.txt", "rgb.txt", "associations.txt"}) fs::remove(path_ / list);
  for (const char* images : {"depth", "rgb"}) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(path_ / images)) files.push_back(entry.path());
    std::ranges::sort(files);
    for (std::size_t i = 0; i < files.size(); ++i)
      fs::rename(files[i], path_ / images / fmt::format("{:04}.png", i));
  }
  const RecordingReport report = inspect(path_);
  EXPECT_THAT(kinds(report), ElementsAre(FindingKind::kMissingPoses)) << messages(report);
  EXPECT_THAT(messages(report), HasSubstr("images are numbered, their times counted from 0.000 to 1.967 s"));
  EXPECT_THAT(to_text(report), ::testing::ContainsRegex("depth +60, no stamps of their own"));
  EXPECT_THAT(to_text(report), ::testing::Not(::testing::ContainsRegex("poses +60, no stamps")));
}

TEST_F(RoomCheck, ADepthScaleThatLooksWrongMakesTheResultDoubtful) {
  const RecordingOptions wrong{.depth_units_per_m = 100'000};
  auto recording = open_recording(path_, wrong);
  ASSERT_TRUE(recording);
  const auto forced = check_before_run(*recording, {.force = true});
  ASSERT_TRUE(forced);
  EXPECT_THAT(forced->doubts, ::testing::Contains(HasSubstr("5000 units per metre instead of 100000")));
  fs::remove(path_ / "groundtruth.txt");
  recording = open_recording(path_, wrong);
  const auto blind = check_before_run(*recording, {.poses = PoseUse::kComparesWith});
  ASSERT_TRUE(blind);
  EXPECT_THAT(blind->doubts, ElementsAre(HasSubstr("the depth scale may be wrong: median depth 0.1")));
  EXPECT_THAT(blind->doubts, ElementsAre(HasSubstr("at 100000 units per metre")));
  // Assumed, and plausible.
  ASSERT_TRUE(write_file_text(path_ / "camera.txt", "fx 140\nfy 141\ncx 79.5\ncy 59.5\n"));
  recording = open_recording(path_);
  const auto assumed = check_before_run(*recording, {.poses = PoseUse::kComparesWith});
  ASSERT_TRUE(assumed);
  EXPECT_THAT(assumed->doubts, IsEmpty());
  EXPECT_THAT(assumed->warnings, ElementsAre(HasSubstr("depth is taken as 5000 units per metre")));
}

TEST_F(RoomCheck, PosesOfAnotherRecordingAreFound) {
  // The order of the poses reversed and stretched: a smooth motion, but not this one.
  const auto recording = open_recording(path_);
  const Trajectory& poses = (*recording)->info().trajectory;
  auto other = poses.rbegin();
  change_poses(path_, [&](StampedPose pose) {
    const SE3& reversed = (other++)->T_world_base;
    return StampedPose{pose.stamp, {reversed.rotation(), 3 * reversed.translation()}};
  });
  const RecordingReport report = inspect(path_);
  EXPECT_THAT(kinds(report), ElementsAre(FindingKind::kPoorAgreement)) << messages(report);
}

TEST_F(RoomCheck, BackwardStampsAndMissingThingsAreFound) {
  std::string depth = file_text(path_ / "depth.txt");
  const std::size_t last = depth.rfind('\n', depth.size() - 2) + 1;
  depth = depth.substr(0, last) + "999.0 depth/none.png\n" + depth.substr(last) + "2000.0 depth/none.png\n";
  ASSERT_TRUE(write_file_text(path_ / "depth.txt", depth));
  const RecordingReport report = inspect(path_);
  EXPECT_THAT(kinds(report),
              ::testing::IsSupersetOf({FindingKind::kStamps, FindingKind::kMissing, FindingKind::kGap}))
      << messages(report);
  EXPECT_THAT(messages(report),
              HasSubstr("1 line of depth.txt left out: stamps that run backwards or repeat"));
  EXPECT_THAT(messages(report), HasSubstr("1 image missing (first: depth/none.png)"));
  EXPECT_THAT(messages(report), HasSubstr("1 of 61 depth images without a pose"));
  EXPECT_THAT(messages(report), HasSubstr("1 of 61 depth images without a colour image"));
}

TEST_F(RoomCheck, ShiftedColorIsFound) {
  const fs::path path = folder_.path() / "shifted";
  write_room(path, {.color_right_px = 9, .frames = 20});
  const RecordingReport report = inspect(path);
  EXPECT_THAT(kinds(report), ElementsAre(FindingKind::kUnregisteredColor)) << messages(report);
  EXPECT_NEAR(report.color_shift.right_px, 9, 1);
  EXPECT_NEAR(report.color_shift.down_px, 0, 1);
}

TEST_F(RoomCheck, ColorOfAnotherFocalLengthIsFound) {
  const fs::path path = folder_.path() / "scaled";
  for (const double ratio : {0.9, 1.08}) {
    fs::remove_all(path);
    write_room(path, {.color_right_px = -4, .color_scale_ratio = ratio, .frames = 20});
    const RecordingReport report = inspect(path);
    EXPECT_THAT(kinds(report), ElementsAre(FindingKind::kUnregisteredColor)) << messages(report);
    EXPECT_NEAR(report.color_shift.scale_ratio, ratio, 0.021);
    EXPECT_NEAR(report.color_shift.right_px, -4, 2.1);
    EXPECT_THAT(messages(report), HasSubstr("the colour image is scaled by about"));
  }
}

/// Share of the pixels whose colours are the same, of all frames that both have.
double same_colors_ratio(const Recording& a, const Recording& b) {
  std::size_t same = 0, all = 0;
  for (std::size_t i = 0; i < std::min(a.info().frame_count, b.info().frame_count); ++i) {
    const auto from_a = a.read(i), from_b = b.read(i);
    EXPECT_TRUE(from_a && from_b);
    if (!from_a || !from_b) return 0;
    for (std::size_t k = 0; k < from_a->color.size(); ++k) {
      same += std::abs(from_a->color.pixels()[k].r - from_b->color.pixels()[k].r) < 10;
      ++all;
    }
  }
  return static_cast<double>(same) / static_cast<double>(all);
}

TEST_F(RoomCheck, ColorIsRegisteredBeforeARunIfTheImagesShowHow) {
  const fs::path path = folder_.path() / "beside";
  write_room(path, {.color_right_px = 3, .color_scale_ratio = 0.9, .color_left_m = -0.03, .frames = 60});
  const auto registered = open_recording(path_);  // the same walk
  auto recording = open_recording(path);
  ASSERT_TRUE(registered && recording);
  const double before = same_colors_ratio(**recording, **registered);
  auto left_alone = open_recording(path);
  const auto found = check_before_run(*left_alone, {.register_color = false});
  ASSERT_TRUE(found);
  EXPECT_THAT(found->warnings, ElementsAre(HasSubstr("colour is not registered to depth")));
  EXPECT_EQ(same_colors_ratio(**left_alone, **registered), before);
  const Preflight live = check_images(**left_alone);  // of frames that were taken already
  EXPECT_THAT(live.warnings, ElementsAre(HasSubstr("colour is not registered to depth")));
  EXPECT_THAT(live.doubts, IsEmpty());
  const auto said = check_before_run(*recording, {});
  ASSERT_TRUE(said);
  EXPECT_THAT(said->doubts, IsEmpty());
  EXPECT_THAT(said->warnings, ElementsAre(HasSubstr("colour was not registered to depth and is now")));
  // What is left are pixels on borders, whose colours are mixed.
  EXPECT_GT(1 - before, 0.03);
  EXPECT_LT(1 - same_colors_ratio(**recording, **registered), 0.02);
}

TEST_F(RoomCheck, ColorOfAShortRecordingIsNotRegisteredByWhatLittleItShows) {
  const fs::path path = folder_.path() / "short";
  write_room(path, {.color_right_px = 3, .color_scale_ratio = 0.9, .color_left_m = -0.03, .frames = 20});
  const auto recording = open_recording(path);
  ASSERT_TRUE(recording);
  EXPECT_FALSE(fit_color_registration(**recording));
}

TEST(ColorShift, EdgesInAPartOfTheImageSayNothing) {
  // Columns of depth and colour, 8 px apart: over the whole image, and in its left third only.
  for (const int width : {320, 106}) {
    RgbdFrame frame;
    frame.depth = {Image<std::uint16_t>(320, 240, std::uint16_t{1000}), 1e-3};
    frame.color = Image<Rgb8>(320, 240);
    for (int y = 0; y < 240; ++y)
      for (int x = 0; x < width; ++x) {
        const bool is_far = x % 64 < 32, is_bright = x >= 8 && (x - 8) % 64 < 32;
        if (is_far) frame.depth.units(x, y) = 2000;
        const auto gray = static_cast<std::uint8_t>((is_far ? 10 : 0) + (is_bright ? 200 : 0));
        frame.color(x, y) = {gray, gray, gray};
      }
    ColorShiftEstimator estimator;
    estimator.add(frame);
    EXPECT_EQ(estimator.best().right_px, width == 320 ? 8 : 0) << width;
    EXPECT_EQ(estimator.best().is_judged, width == 320);
  }
}

TEST_F(RoomCheck, ColorThatIsRegisteredStaysAsItIs) {
  auto recording = open_recording(path_);
  ASSERT_TRUE(recording);
  const Recording* const before = recording->get();
  EXPECT_FALSE(fit_color_registration(**recording));
  ASSERT_TRUE(check_before_run(*recording, {}));
  EXPECT_EQ(recording->get(), before);
}

TEST_F(RoomCheck, AStillCameraIsNotJudged) {
  std::string text;
  for (int i = 0; i < 60; ++i) text += fmt::format("{:.9f} 0 0 0 0 0 0 1\n", 1000.0 + 0.033333333 * i);
  ASSERT_TRUE(write_file_text(path_ / "groundtruth.txt", text));
  const RecordingReport report = inspect(path_);
  EXPECT_EQ(report.pairs_compared, 0U);
  EXPECT_THAT(report.agreement, IsEmpty());
  EXPECT_THAT(report.findings, IsEmpty());
  EXPECT_THAT(to_text(report), HasSubstr("no two frames with poses are far enough apart"));
}

TEST_F(RoomCheck, TextAndJsonSayTheSame) {
  const RecordingReport report = inspect(path_, {.depth_units_per_m = 500});
  const JsonValue json = to_json(report);
  EXPECT_EQ(*json.find("kind")->as_string(), "TUM RGB-D");
  EXPECT_EQ(json.find("frames")->number_or(0), 60);
  EXPECT_NEAR(json.find("depth")->find("unit_m")->number_or(0), 0.002, 1e-12);
  EXPECT_EQ(json.find("streams")->as_array()->size(), 3U);
  const auto& findings = *json.find("findings")->as_array();
  ASSERT_EQ(findings.size(), report.findings.size());
  const std::string text = to_text(report);
  for (const JsonValue& finding : findings)
    EXPECT_THAT(text, HasSubstr(*finding.find("message")->as_string()));
  EXPECT_THAT(text, HasSubstr("60 with depth, 60 of them with colour, 60 with a pose"));
}

TEST(PoseAgreement, IsExactForAWallSeenFromTwoPlaces) {
  // A wall at z = 3 m, camera moved by (0.1, 0, 0.5): prediction and measurement are both 2.5 m.
  const auto wall = [](double depth_m, const SE3& pose) {
    RgbdFrame frame;
    frame.depth = {
        Image<std::uint16_t>(kCamera.width, kCamera.height, static_cast<std::uint16_t>(depth_m * 1e4)), 1e-4};
    frame.T_world_camera = pose;
    return frame;
  };
  const RgbdFrame from = wall(3.0, SE3()), to = wall(2.5, SE3(Mat3::Identity(), Vec3(0.1, 0, 0.5)));
  const Agreement given = compare(from, to, kCamera, {});
  EXPECT_NEAR(given.median_m, 0, 1e-9);
  EXPECT_NEAR(given.systematic, 0, 1e-9);
  EXPECT_GT(given.overlap_ratio, 0.5);
  EXPECT_NEAR(compare(from, to, kCamera, {.poses_ignored = true}).median_m, 0.5, 1e-9);
  EXPECT_NEAR(compare(from, to, kCamera, {.poses_inverted = true}).median_m, 1.0, 1e-9);
  EXPECT_NEAR(compare(from, to, kCamera, {.depth_factor = 2}).median_m, 0.5, 1e-9);
  EXPECT_NEAR(compare(from, to, kCamera, {.depth_factor = 2}).relative, 0.1, 1e-9);
}

}  // namespace
}  // namespace hm
