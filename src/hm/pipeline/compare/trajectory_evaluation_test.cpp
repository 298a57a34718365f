#include "hm/pipeline/compare/trajectory_evaluation.hpp"

#include <gtest/gtest.h>

#include <array>

#include "hm/io/testing/testing_recordings.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

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

}  // namespace
}  // namespace hm
