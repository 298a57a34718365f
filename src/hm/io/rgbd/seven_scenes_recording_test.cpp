#include <cmath>

#include "hm/io/testing/testing_recordings.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;
using namespace testing_recordings;

TEST(SevenScenes, FlatFolderWithItsTraps) {
  const TemporaryFolder folder;
  Mat4 skewed = random_pose(3).matrix();
  skewed(0, 1) += 2e-4;  // not quite orthonormal, as published
  write_seven_scenes_frame(folder.path(), 0, matrix_text(random_pose(1).matrix()));
  write_seven_scenes_frame(folder.path(), 1, matrix_text(skewed));
  write_seven_scenes_frame(folder.path(), 2, matrix_text(Mat4::Constant(std::nan(""))));
  write_seven_scenes_frame(folder.path(), 3, matrix_text(Mat4::Constant(-INFINITY)));
  write_seven_scenes_frame(folder.path(), 4, matrix_text(Mat4::Zero()));
  write_seven_scenes_frame(folder.path(), 5, "1 0 0 0\n0 1 0 0\n0 zero 1 0\n0 0 0 1\n");
  write_seven_scenes_frame(folder.path(), 7, matrix_text(random_pose(7).matrix()));
  fs::remove(folder.path() / "frame-000007.depth.png");
  write_seven_scenes_frame(folder.path(), 9, "");
  const auto opened = open_recording(folder.path());
  ASSERT_TRUE(opened) << to_string(opened.error());
  const Recording& recording = **opened;
  const RecordingInfo& info = recording.info();
  EXPECT_EQ(info.kind, RecordingKind::kSevenScenes);
  EXPECT_EQ(info.frame_count, 8U);
  EXPECT_EQ(info.posed_count, 3U);
  EXPECT_EQ(info.color_count, 8U);
  EXPECT_FALSE(info.has_own_stamps);
  EXPECT_EQ(info.stamps[1], Time::from_seconds(1.0 / 30));
  EXPECT_EQ(info.stamps[6], Time::from_seconds(7.0 / 30));
  EXPECT_EQ(info.camera.fx, 585.0 * 32 / 640);
  EXPECT_DOUBLE_EQ(info.depth_unit_m, 1e-3);
  EXPECT_LT(pose_difference(*recording.read(0)->T_world_camera, random_pose(1)), 1e-9);
  EXPECT_TRUE(is_rigid(*recording.read(1)->T_world_camera));
  EXPECT_LT(pose_difference(*recording.read(1)->T_world_camera, random_pose(3)), 2e-4);
  for (const std::size_t lost : {2U, 3U, 4U, 5U, 7U})
    EXPECT_FALSE(recording.read(lost)->T_world_camera) << lost;
  EXPECT_EQ(recording.read(6).error().code, ErrorCode::kNotFound);
  EXPECT_NE(info.notes.find("frame-000005.pose.txt:3: `zero` is not a number"), std::string::npos)
      << info.notes;
  EXPECT_NE(info.notes.find("2 poses not usable: NaN or infinity"), std::string::npos) << info.notes;
}

TEST(SevenScenes, SequencesBelowTheFolderAndCameraAboveTheSequence) {
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < 3; ++i) {
    write_seven_scenes_frame(folder.path() / "seq-01", i, matrix_text(random_pose(i).matrix()));
    write_seven_scenes_frame(folder.path() / "seq-02", i, matrix_text(random_pose(10 + i).matrix()));
  }
  ASSERT_TRUE(write_file_text(folder.path() / "camera.txt",
                              "fx 30\nfy 31\ncx 16\ncy 12\ndepth_scale 1000\nrate_hz 10\n"));
  const auto both = open_recording(folder.path());
  ASSERT_TRUE(both) << to_string(both.error());
  EXPECT_EQ((*both)->info().frame_count, 6U);
  EXPECT_EQ((*both)->info().stamps[1], Time::from_seconds(0.1));
  EXPECT_TRUE(std::ranges::is_sorted((*both)->info().stamps));
  EXPECT_LT(pose_difference(*(*both)->read(4)->T_world_camera, random_pose(11)), 1e-9);
  for (const fs::path& one : {folder.path() / "seq-02", folder.path() / "seq-02" / ""}) {
    const auto second = open_recording(one);
    ASSERT_TRUE(second) << to_string(second.error());
    EXPECT_EQ((*second)->info().frame_count, 3U);
    EXPECT_EQ((*second)->info().camera.fx, 30);
    EXPECT_EQ((*second)->info().camera.width, 32);
  }
}

TEST(SevenScenes, TheirCameraIsAnAssumptionUnlessTheFolderHasANameOfThem) {
  const TemporaryFolder folder;
  for (const auto& [name, assumptions] : std::vector<std::pair<std::string, std::size_t>>{
           {"kitchen_of_mine", 1}, {"chess", 0}, {"fire/seq-02", 0}}) {
    write_seven_scenes_frame(folder.path() / name, 0, matrix_text(random_pose(1).matrix()));
    const auto opened = open_recording(folder.path() / name);
    ASSERT_TRUE(opened) << to_string(opened.error());
    EXPECT_EQ((*opened)->info().assumptions.size(), assumptions) << name;
    const auto given =
        open_recording(folder.path() / name, {.camera = PinholeCamera{32, 24, 30, 30, 16, 12, {}}});
    ASSERT_TRUE(given) << to_string(given.error());
    EXPECT_EQ((*given)->info().assumptions.size(), assumptions) << name << ": its units of depth";
  }
}

TEST(SevenScenes, DepthMayBePgm) {  // 3RScan
  const TemporaryFolder folder;
  write_seven_scenes_frame(folder.path(), 0, matrix_text(Mat4::Identity()));
  fs::remove(folder.path() / "frame-000000.depth.png");
  std::string pgm = "P5\n32 24\n65535\n";
  for (int i = 0; i < 32 * 24; ++i) pgm += {static_cast<char>(i >> 8), static_cast<char>(i & 0xff)};
  ASSERT_TRUE(write_file_text(folder.path() / "frame-000000.depth.pgm", pgm));
  const auto opened = open_recording(folder.path());
  ASSERT_TRUE(opened) << to_string(opened.error());
  EXPECT_EQ((*opened)->info().kind, RecordingKind::kSevenScenes);
  const auto frame = (*opened)->read(0);
  ASSERT_TRUE(frame) << to_string(frame.error());
  EXPECT_EQ(frame->depth.units(31, 23), 767);
}

TEST(SevenScenes, JpegColorAndBadPictures) {
  const TemporaryFolder folder;
  write_seven_scenes_frame(folder.path(), 0, matrix_text(Mat4::Identity()));
  fs::remove(folder.path() / "frame-000000.color.png");
  ASSERT_TRUE(write_file_bytes(folder.path() / "frame-000000.color.jpg",
                               encode_jpeg(Image<Rgb8>(64, 48, {200, 100, 50}))));
  const auto frame = (*open_recording(folder.path()))->read(0);
  ASSERT_TRUE(frame) << to_string(frame.error());
  EXPECT_EQ(frame->color.width(), 32);
  EXPECT_NEAR(frame->color(3, 3).r, 200, 3);
  const auto stretched = [&] {
    const auto opened = open_recording(folder.path());
    return std::ranges::count_if((*opened)->info().assumptions, [](const std::string& assumption) {
      return assumption.find("colour is stretched") != std::string::npos;
    });
  };
  EXPECT_EQ(stretched(), 0);
  ASSERT_TRUE(write_file_bytes(folder.path() / "frame-000000.color.jpg", encode_jpeg(Image<Rgb8>(64, 36))));
  EXPECT_EQ(stretched(), 1);
  ASSERT_TRUE(write_file_text(folder.path() / "frame-000000.depth.png", ""));
  EXPECT_EQ((*open_recording(folder.path()))->read(0).error().code, ErrorCode::kTruncated);
}

TEST(IclNuim, NumbersInsteadOfStampsAndNegativeFy) {
  const TemporaryFolder folder;
  write_small_icl(folder.path(), 5);
  const auto opened = open_recording(folder.path());
  ASSERT_TRUE(opened) << to_string(opened.error());
  const RecordingInfo& info = (*opened)->info();
  EXPECT_EQ(info.kind, RecordingKind::kIclNuim);
  EXPECT_EQ(info.frame_count, 5U);
  EXPECT_EQ(info.posed_count, 5U);
  EXPECT_LT(info.camera.fy, 0);
  EXPECT_EQ(info.camera_source, "the ICL-NUIM camera");
  EXPECT_EQ(info.stamps[2], Time::from_seconds(0.1));
  EXPECT_DOUBLE_EQ((*opened)->read(2)->T_world_camera->translation().x(), 0.75);
  EXPECT_TRUE(same_pixels((*opened)->read(2)->color, random_color(32, 24, 3)));
  EXPECT_EQ(info.assumptions.size(), 1U);  // another tool may count frames, too
  fs::rename(folder.path() / "groundtruth.txt", folder.path() / "traj3.gt.freiburg");
  const auto as_published = open_recording(folder.path());
  EXPECT_EQ((*as_published)->info().posed_count, 5U);
  EXPECT_TRUE((*as_published)->info().assumptions.empty());
  fs::remove(folder.path() / "traj3.gt.freiburg");
  const auto blind = open_recording(folder.path());
  EXPECT_EQ((*blind)->info().posed_count, 0U);
  EXPECT_NE((*blind)->info().notes.find("no poses"), std::string::npos);
}

TEST(RealRecording, SevenScenes) {
  const fs::path path = real_recording("sevenscenes_a");
  if (!fs::exists(path)) GTEST_SKIP() << "no recording at " << path;
  const auto opened = open_recording(path);
  ASSERT_TRUE(opened) << to_string(opened.error());
  const RecordingInfo& info = (*opened)->info();
  EXPECT_EQ(info.kind, RecordingKind::kSevenScenes);
  EXPECT_EQ(info.frame_count, 600U);
  EXPECT_EQ(info.posed_count, 600U);
  EXPECT_EQ(info.camera.fx, 585);
  const auto frame = (*opened)->read(0);
  ASSERT_TRUE(frame) << to_string(frame.error());
  EXPECT_NEAR(frame->T_world_camera->translation().x(), -0.340456, 1e-5);
  EXPECT_TRUE(is_rigid(*frame->T_world_camera));
  EXPECT_EQ(std::ranges::count(frame->depth.units.pixels(), 65535), 0);
}

TEST(RealRecording, TumFr1) {
  const fs::path path = real_recording("tum_fr1_xyz");
  if (!fs::exists(path)) GTEST_SKIP() << "no recording at " << path;
  const auto opened = open_recording(path);
  ASSERT_TRUE(opened) << to_string(opened.error());
  const RecordingInfo& info = (*opened)->info();
  EXPECT_EQ(info.kind, RecordingKind::kTumRgbd);
  EXPECT_EQ(info.frame_count, 101U);
  EXPECT_EQ(info.paired_count, 101U);
  EXPECT_EQ(info.posed_count, 101U);
  EXPECT_EQ(info.trajectory.size(), 764U);
  EXPECT_EQ(info.stamps[0].ns, 1305031102160407000);
  EXPECT_EQ(info.camera.distortion.k1, 0.262383);
  EXPECT_DOUBLE_EQ(info.depth_unit_m, 1.0 / 5000);
}

TEST(RealRecording, IclNuim) {
  const fs::path path = real_recording("icl_of_kt3");
  if (!fs::exists(path)) GTEST_SKIP() << "no recording at " << path;
  const auto opened = open_recording(path);
  ASSERT_TRUE(opened) << to_string(opened.error());
  EXPECT_EQ((*opened)->info().kind, RecordingKind::kIclNuim);
  EXPECT_EQ((*opened)->info().frame_count, 30U);
  EXPECT_EQ((*opened)->info().posed_count, 30U);
  EXPECT_EQ((*opened)->info().camera.fy, -480);
  EXPECT_NEAR((*opened)->read(0)->T_world_camera->translation().z(), -2.5, 1e-9);
}

}  // namespace
}  // namespace hm
