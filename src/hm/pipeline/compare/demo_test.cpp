#include "hm/pipeline/compare/demo.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

class Demo : public testing::Test {
 protected:
  [[nodiscard]] DemoOptions options() const {
    DemoOptions options;
    options.output = temporary_ / "demo";
    options.simulation.world = WorldKind::kRoom;
    options.simulation.frame_limit = 12;
    options.simulation.truth_spacing_m = 0.1;
    options.parameters.tsdf.voxel_size_m = 0.04;
    options.parameters.reconstruction.pictures = false;
    options.parameters.mesh_error.samples = 5'000;
    options.run.threads = 2;
    return options;
  }
  [[nodiscard]] fs::path recording() const { return options().output / "recording"; }

  TemporaryFolder temporary_;
};

TEST_F(Demo, ASecondOneIsRefusedWhileTheFirstRuns) {
  DemoOptions first = options();
  std::vector<std::string> stages;
  std::size_t reports = 0, refused = 0;
  first.run.progress = [&](const Progress& progress) {
    if (std::find(stages.begin(), stages.end(), progress.stage) != stages.end()) return;
    stages.emplace_back(progress.stage);
    ++reports;
    const auto second = run_demo(options());
    if (second) return;
    EXPECT_EQ(second.error().code, ErrorCode::kUsage);
    refused += second.error().message.find("another run writes into this folder now") != std::string::npos;
  };
  const auto summary = run_demo(first);
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_NE(std::find(stages.begin(), stages.end(), "simulating"), stages.end());
  EXPECT_NE(std::find(stages.begin(), stages.end(), "reconstructing"), stages.end());
  EXPECT_EQ(refused, reports);
  EXPECT_EQ(summary->reconstruction.frames_integrated, 12u);
  const auto again = run_demo(options());  // the first has ended: its results are replaced
  ASSERT_TRUE(again) << to_string(again.error());
}

TEST_F(Demo, KeepsTheRecordingOfAResultThatItMayNotReplace) {
  ASSERT_TRUE(run_demo(options()));
  const fs::path result = options().output / "result", mine = recording() / "groundtruth.txt";
  std::ofstream(mine, std::ios::app) << "# mine\n";
  const auto length = fs::file_size(mine);
  ASSERT_TRUE(write_file_text(result / "run.json", R"({"verb": "slam", "state": "complete"})"));
  const auto refused = run_demo(options());
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
  EXPECT_EQ(refused.error().where, result.string());
  EXPECT_EQ(fs::file_size(mine), length) << "the recording that was there is gone";
  EXPECT_TRUE(open_recording(recording()));
}

TEST_F(Demo, LeavesARecordingAloneThatIsBeingSimulated) {
  SimulationOptions simulation{options().simulation, recording(), options().run};
  std::size_t reports = 0, refused = 0;
  simulation.run.progress = [&](const Progress&) {
    ++reports;
    const auto demo = run_demo(options());
    refused += !demo && demo.error().where == recording().string();
  };
  ASSERT_TRUE(simulate_recording(simulation));
  EXPECT_GE(reports, 2u);
  EXPECT_EQ(refused, reports);
  EXPECT_TRUE(open_recording(recording()));
}

}  // namespace
}  // namespace hm
