#include "hm/pipeline/simulate/office_recording.hpp"

#include <gtest/gtest.h>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/pipeline/simulate/simulation_folder.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

TEST(OfficeRecording, IsReadBackAsItWasDriven) {
  const TemporaryFolder temporary;
  OfficeRecordingOptions options{{}, temporary.path() / "office", {}};
  options.simulation.seed = 5;
  options.simulation.scan_limit = 50;
  const auto summary = simulate_office_recording(options);
  ASSERT_TRUE(summary) << to_string(summary.error());
  for (const fs::path& path : summary->outputs) EXPECT_TRUE(fs::exists(path)) << path;
  EXPECT_EQ(summary->scans, 50U);
  EXPECT_GT(summary->valid_ratio, 0.7);
  const auto recording = open_laser_recording(options.output);
  ASSERT_TRUE(recording) << to_string(recording.error());
  ASSERT_EQ(recording->lasers.size(), 1U);
  const OfficeSimulation simulation(options.simulation);
  const auto& scans = recording->lasers.front().scans;
  ASSERT_EQ(scans.size(), 50U);
  ASSERT_EQ(recording->odometry.size(), 50U);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    EXPECT_EQ(scans[i].ranges_m, simulation.scan(i).ranges_m);
    EXPECT_EQ(scans[i].stamp, simulation.odometry()[i].stamp);
    EXPECT_LT((recording->odometry[i].T_world_base.translation() -
               simulation.odometry()[i].T_world_base.translation())
                  .norm(),
              1e-9);
  }
  EXPECT_EQ(recording->truth.size(), simulation.truth().size());
  // A folder with a recording is left alone; removal takes all that was written.
  const auto again = simulate_office_recording(options);
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::kUsage);
  ASSERT_TRUE(remove_simulation(options.output));
  EXPECT_FALSE(fs::exists(options.output));
}

TEST(OfficeRecording, StoppedItLeavesNothing) {
  const TemporaryFolder temporary;
  std::stop_source stop;
  stop.request_stop();
  OfficeRecordingOptions options{{}, temporary.path() / "office", {}};
  options.run.stop = stop.get_token();
  const auto summary = simulate_office_recording(options);
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kCancelled);
  EXPECT_FALSE(fs::exists(options.output));
}

}  // namespace
}  // namespace hm
