#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hm/io/rgbd/tum_writer.hpp"
#include "hm/io/testing/real_data_test_support.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/pipeline/checks/pose_agreement.hpp"
#include "hm/pipeline/checks/recording_check_test_support.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;
using namespace recording_check_test;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

fs::path real_recording(const std::string& name) { return real_data_folder() / "rgbd" / name; }

/// What is odd about a recording: the colour camera of the first Kinect is not registered in one of them.
std::vector<FindingKind> odd_in(const std::string& name) {
  if (name == "sevenscenes_a") return {FindingKind::kUnregisteredColor};
  return {};
}

class RealCheck : public ::testing::TestWithParam<const char*> {};

TEST_P(RealCheck, WhatIsOddIsFoundAndEveryInjectedFaultIs) {
  const fs::path path = real_recording(GetParam());
  if (!fs::exists(path)) GTEST_SKIP() << "no recording at " << path;
  const RecordingReport report = inspect(path);
  EXPECT_THAT(kinds(report), ::testing::ElementsAreArray(odd_in(GetParam()))) << messages(report);
  EXPECT_GT(report.pairs_compared, 8U);
  EXPECT_LT(report.agreement[0].agreement_mm, 20.0);
  PinholeCamera flipped = report.info.camera;
  flipped.fy = -flipped.fy;
  const InspectOptions quick{.depth_samples = 2};
  EXPECT_THAT(kinds(inspect(path, {.camera = flipped}, quick)), ::testing::Contains(FindingKind::kFlippedFy));
  const double units_per_m = 1.0 / report.info.depth_unit_m;
  for (const double factor : {0.1, 0.2, 10.0}) {
    const RecordingReport scaled = inspect(path, {.depth_units_per_m = factor * units_per_m}, quick);
    EXPECT_THAT(kinds(scaled), ::testing::Contains(FindingKind::kDepthScale)) << factor;
    EXPECT_THAT(messages(scaled), HasSubstr(fmt::format("{:.4g} units per metre instead", units_per_m)));
  }
}
INSTANTIATE_TEST_SUITE_P(All, RealCheck, ::testing::Values("sevenscenes_a", "tum_fr1_xyz", "icl_of_kt3"),
                         [](const auto& instance) { return std::string(instance.param); });

/// A copy of the list files with inverted poses, images linked.
TEST_P(RealCheck, InvertedPosesAreFound) {
  const fs::path path = real_recording(GetParam());
  if (!fs::exists(path)) GTEST_SKIP() << "no recording at " << path;
  const auto recording = open_recording(path);
  ASSERT_TRUE(recording);
  const RecordingInfo& info = (*recording)->info();
  const TemporaryFolder folder;
  auto writer = TumWriter::create(folder.path() / "inverted", info.camera.without_distortion(), 5000);
  for (std::size_t i = 0; i < info.frame_count; i += 3) {
    auto frame = (*recording)->read(i);
    ASSERT_TRUE(frame);
    frame->color = {};
    frame->T_world_camera = frame->T_world_camera->inverse();
    ASSERT_TRUE(writer->add(*frame));
    if (i > 150) break;
  }
  ASSERT_TRUE(writer->finish());
  const RecordingReport report = inspect(folder.path() / "inverted");
  EXPECT_THAT(kinds(report), ElementsAre(FindingKind::kMissingColor, FindingKind::kInvertedPoses))
      << messages(report);
}

TEST(RealAgreement, SevenScenesAtTenFrames) {
  const fs::path path = real_recording("sevenscenes_a");
  if (!fs::exists(path)) GTEST_SKIP() << "no recording at " << path;
  const auto recording = open_recording(path);
  std::vector<FramePair> pairs;
  for (std::size_t i = 0; i + 10 < 600; i += 30)
    pairs.push_back({*(*recording)->read(i), *(*recording)->read(i + 10)});
  const double median_mm = 1e3 * median_of(compare_all(pairs, (*recording)->info().camera, {})).median_m;
  EXPECT_NEAR(median_mm, 6.0, 1.0);
}

}  // namespace
}  // namespace hm
