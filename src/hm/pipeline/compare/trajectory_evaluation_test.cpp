#include "hm/pipeline/compare/trajectory_evaluation.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "hm/io/pose/trajectory_file.hpp"
#include "hm/io/testing/testing_recordings.hpp"
#include "hm/pipeline/common/truth_comparison.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

TEST(TrajectoryEvaluation, ATruthWithoutPosesIsNotBlamedOnTheEstimate) {
  const TemporaryFolder folder;
  const fs::path truth = folder / "recording", estimate = folder / "estimate.txt";
  testing_recordings::write_small_tum(truth, 4);
  fs::remove(truth / "groundtruth.txt");
  ASSERT_TRUE(write_file_text(estimate, "1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n3 0 0 0 0 0 0 1\n"));
  const auto error = evaluate_trajectory_files(std::array{estimate}, truth, {});
  ASSERT_FALSE(error);
  EXPECT_NE(error.error().message.find("the truth has no pose"), std::string::npos) << error.error().message;
  EXPECT_EQ(error.error().where, truth.string());
}

/// Writes a bent path of poses: 12 numbers each, or with stamps from `begin_s` at 10 Hz, scaled.
void write_path(const fs::path& path, int poses, std::optional<double> begin_s, double scale = 1) {
  std::string text;
  for (int i = 0; i < poses; ++i) {
    const double x = scale * 0.1 * i, y = scale * 0.001 * i * i;
    text += begin_s ? fmt::format("{:.3f} {} {} 0 0 0 0 1\n", *begin_s + 0.1 * i, x, y)
                    : fmt::format("1 0 0 {} 0 1 0 {} 0 0 1 0\n", x, y);
  }
  ASSERT_TRUE(write_file_text(path, text));
}

/// The comparison of two files that these two calls describe; both in the same folder.
class TwoPaths : public ::testing::Test {
 protected:
  [[nodiscard]] Result<TrajectoryComparison> compare(const TrajectoryErrorParams& params = {}) const {
    return evaluate_trajectory_files(std::array{estimate_}, truth_, params);
  }
  TemporaryFolder folder_;
  fs::path truth_ = folder_ / "truth.txt", estimate_ = folder_ / "estimate.txt";
};

TEST_F(TwoPaths, WithoutStampsMustHaveAsManyPosesAndHaveNoSeconds) {
  write_path(truth_, 30, std::nullopt);
  write_path(estimate_, 20, std::nullopt);
  const auto refused = compare();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("estimate has 20 poses without stamps, and the truth 30"));
  write_path(estimate_, 30, std::nullopt);
  const auto compared = compare();
  ASSERT_TRUE(compared) << to_string(compared.error());
  EXPECT_EQ(compared->estimates[0].error.pairs, 30U);
  EXPECT_THAT(to_text(*compared), HasSubstr("over a frame"));
  EXPECT_EQ(to_text(*compared).find("over a second"), std::string::npos) << to_text(*compared);
  EXPECT_EQ(to_json(*compared).find("rpe_second_m"), nullptr);
  const auto over_seconds = compare({.rpe_unit = RpeUnit::kSeconds});
  ASSERT_FALSE(over_seconds);
  EXPECT_THAT(over_seconds.error().message, HasSubstr("rpe_unit"));
}

TEST_F(TwoPaths, OfWhichOneHasNoStampsAreRefused) {
  write_path(truth_, 30, std::nullopt);
  write_path(estimate_, 30, 0.0);
  const auto bare_truth = compare();
  ASSERT_FALSE(bare_truth);
  EXPECT_THAT(bare_truth.error().message, HasSubstr("the truth has 30 poses without stamps"));
  EXPECT_EQ(bare_truth.error().where, truth_.string());
  write_path(truth_, 30, 0.0);
  write_path(estimate_, 30, std::nullopt);
  const auto bare_estimate = compare();
  ASSERT_FALSE(bare_estimate);
  EXPECT_THAT(bare_estimate.error().message, HasSubstr("the estimate has 30 poses without stamps"));
  EXPECT_EQ(bare_estimate.error().where, estimate_.string());
}

TEST_F(TwoPaths, ARepeatedStampIsCountedAsInARecording) {
  write_path(estimate_, 30, 5.0);
  write_path(truth_, 30, 5.0);
  ASSERT_TRUE(write_file_text(truth_, testing_recordings::file_text(truth_) + "7.900 9 9 9 0 0 0 1\n"));
  const auto compared = compare();
  ASSERT_TRUE(compared) << to_string(compared.error());
  EXPECT_EQ(compared->estimates[0].error.pairs, 30U);
  EXPECT_THAT(compared->warnings,
              ::testing::Contains(HasSubstr("1 line of truth.txt left out: stamps that run backwards or")));
}

TEST_F(TwoPaths, AnotherSizeIsNamed) {
  write_path(truth_, 30, 5.0);
  for (const auto& [scale, named] : {std::pair{0.2, "0.200 times"}, std::pair{1000.0, "1000.000 times"}}) {
    write_path(estimate_, 30, 5.0, scale);
    const auto compared = compare();
    ASSERT_TRUE(compared) << to_string(compared.error());
    ASSERT_EQ(compared->warnings.size(), 1U);
    EXPECT_THAT(compared->warnings[0], HasSubstr(named));
    EXPECT_NEAR(to_json(*compared).find("size_ratio")->number_or(0), scale, 1e-6 * scale);
    EXPECT_NEAR(to_json(*compared).find("estimate_path_m")->number_or(0),
                scale * compared->estimates[0].error.truth_path_m, 0.02 * scale);
  }
  write_path(estimate_, 30, 5.0, 1.05);
  EXPECT_TRUE(compare()->warnings.empty());
}

/// Runs that compare with the poses of their recording say it in the same words.
TEST_F(TwoPaths, AnotherSizeIsAWarningOfRunsToo) {
  write_path(truth_, 30, 5.0);
  write_path(estimate_, 30, 5.0, 0.2);
  RecordingInfo info;
  info.trajectory = *read_trajectory(truth_);
  std::vector<std::string> warnings;
  EXPECT_TRUE(compare_with_truth(*read_trajectory(estimate_), info, {}, warnings));
  EXPECT_THAT(warnings,
              ::testing::ElementsAre(HasSubstr("the estimate is 0.200 times the size of the truth")));
  warnings.clear();
  EXPECT_TRUE(compare_with_truth(info.trajectory, info, {}, warnings));
  EXPECT_TRUE(warnings.empty());
}

TEST_F(TwoPaths, ARecordingWhosePosesCannotBeReadSaysWhy) {
  write_path(estimate_, 30, 5.0);
  testing_recordings::write_small_tum(folder_ / "recording", 4);
  ASSERT_TRUE(write_file_text(folder_ / "recording" / "groundtruth.txt", "5.0 1 2 3\n"));
  const auto compared =
      evaluate_trajectory_files(std::vector<fs::path>{estimate_}, folder_ / "recording", {});
  ASSERT_FALSE(compared);
  EXPECT_THAT(compared.error().message, HasSubstr("groundtruth.txt:1: 4 columns"));
}

TEST_F(TwoPaths, AMissingOneNamesTheOtherEnding) {
  write_path(truth_, 30, 5.0);
  write_path(folder_ / "estimate.tum", 30, 5.0);
  const auto missing = compare();
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(missing.error().message, HasSubstr((folder_ / "estimate.tum").string()));
  fs::remove(folder_ / "estimate.tum");
  EXPECT_EQ(compare().error().message.find("there is"), std::string::npos);
}

}  // namespace
}  // namespace hm
