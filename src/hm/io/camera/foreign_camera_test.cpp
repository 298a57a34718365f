#include "hm/io/camera/foreign_camera.hpp"

#include <gtest/gtest.h>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

class ForeignCameraFile : public ::testing::Test {
 protected:
  /// What is found in a folder that holds this file alone.
  Result<std::optional<ForeignCamera>> found_in(const std::string& name, const std::string& text) {
    fs::remove_all(folder_);
    fs::create_directories((folder_ / name).parent_path());
    EXPECT_TRUE(write_file_text(folder_ / name, text));
    return find_foreign_camera(folder_);
  }
  /// The camera fx 500, fy 510, cx 320.5, cy 240.5 is found.
  void expect_camera(const std::string& name, const std::string& text, double units_per_m, int width) {
    const auto found = found_in(name, text);
    ASSERT_TRUE(found) << to_string(found.error());
    ASSERT_TRUE(*found) << name;
    const PinholeCamera& camera = (*found)->camera;
    EXPECT_EQ((Vec4(camera.fx, camera.fy, camera.cx, camera.cy)), Vec4(500, 510, 320.5, 240.5)) << name;
    EXPECT_EQ(camera.width, width) << name;
    EXPECT_EQ((*found)->depth_units_per_m.value_or(0), units_per_m) << name;
    EXPECT_EQ((*found)->path, folder_ / name);
  }
  using Vec4 = Eigen::Vector4d;
  TemporaryFolder temporary_;
  fs::path folder_ = temporary_.path() / "above" / "recording";
};

TEST_F(ForeignCameraFile, IsReadAsEachProgramWritesIt) {
  const std::string columns = R"("intrinsic_matrix": [500, 0, 0, 0, 510, 0, 320.5, 240.5, 1])";
  expect_camera("intrinsic.json", R"({"width": 640, "height": 480, "depth_scale": 1000.0, )" + columns + "}",
                1000, 640);
  expect_camera("camera_primesense.json", "{" + columns + "}", 0, 0);
  expect_camera("intrinsic/intrinsic_depth.txt", "500 0 320.5 0\n0 510 240.5 0\n0 0 1 0\n0 0 0 1\n", 1000, 0);
  expect_camera("info.txt",
                "m_versionNumber = 4\nm_depthWidth = 640\nm_depthHeight = 480\nm_depthShift = 1000\n"
                "m_calibrationColorIntrinsic = 9 0 9 0 0 9 9 0 0 0 1 0 0 0 0 1\n"
                "m_calibrationDepthIntrinsic = 500 0 320.5 0 0 510 240.5 0 0 0 1 0 0 0 0 1\n",
                1000, 640);
  expect_camera(
      "cam_params.json",
      R"({"camera": {"w": 640, "h": 480, "fx": 500, "fy": 510, "cx": 320.5, "cy": 240.5, "scale": 6553.5}})",
      6553.5, 640);
}

TEST_F(ForeignCameraFile, IsFoundAboveTheRecordingWhereReplicaHasIt) {
  fs::create_directories(folder_);
  ASSERT_TRUE(write_file_text(folder_.parent_path() / "cam_params.json",
                              R"({"camera": {"fx": 600, "fy": 600, "cx": 599.5, "cy": 339.5}})"));
  const auto found = find_foreign_camera(folder_);
  ASSERT_TRUE(found && *found);
  EXPECT_EQ((*found)->camera.fx, 600);
}

TEST_F(ForeignCameraFile, ThatCannotBeUsedIsNamed) {
  for (const auto& [name, text] : std::vector<std::pair<std::string, std::string>>{
           {"intrinsic.json", "{"},
           {"intrinsic.json", "{}"},
           {"intrinsic.json", R"({"intrinsic_matrix": [500, 0, 0, 0, null, 0, 320, 240, 1]})"},
           {"intrinsic.json", R"({"intrinsic_matrix": [500, 0, 320, 0, 500, 240, 0, 0, 1]})"},  // row by row
           {"intrinsic.json", R"({"width": 40000, "intrinsic_matrix": [500, 0, 0, 0, 500, 0, 320, 240, 1]})"},
           {"intrinsic.json",
            R"({"depth_scale": 1e9, "intrinsic_matrix": [500, 0, 0, 0, 500, 0, 320, 240, 1]})"},
           {"intrinsic.json",
            R"({"depth_scale": 0.001, "intrinsic_matrix": [500, 0, 0, 0, 500, 0, 320, 240, 1]})"},
           {"intrinsics_depth.txt", "500 0 320\n0 510\n"},
           {"info.txt", "m_calibrationDepthIntrinsic = 500 0 320.5\n"},
           {"cam_params.json", R"({"camera": {"fx": 1e300, "fy": 500, "cx": 320, "cy": 240}})"},
           {"cam_params.json", "[]"}}) {
    const auto found = found_in(name, text);
    ASSERT_FALSE(found) << name << ": " << text;
    EXPECT_NE(to_string(found.error()).find(name), std::string::npos) << to_string(found.error());
  }
}

TEST_F(ForeignCameraFile, FourNumbersOfEth3d) {
  const auto found = found_in("calibration.txt", "726.2 726.3 354.6 186.4\n");
  ASSERT_TRUE(found && *found);
  EXPECT_EQ((*found)->camera.fy, 726.3);
  EXPECT_EQ((*found)->camera.cy, 186.4);
  EXPECT_FALSE((*found)->depth_units_per_m);
}

TEST_F(ForeignCameraFile, OfAnotherKindIsLeftAlone) {
  const auto notes = found_in("info.txt", "recorded on Monday\n");
  ASSERT_TRUE(notes);
  EXPECT_FALSE(*notes);
}

}  // namespace
}  // namespace hm
