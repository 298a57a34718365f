#include "hm/pipeline/simulate/laser_simulation_recording.hpp"
#include "hm/core/testing/source_folder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/laser/laser_rig_file.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/pipeline/simulate/simulation_folder.hpp"
#include "hm/pipeline/simulate/simulation_recording.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

class LaserSimulationRecording : public ::testing::Test {
 protected:
  void SetUp() override {
    params_.world = WorldKind::kRoom;
    params_.scan_limit = 300;
    params_.wheel_odometry = true;
  }

  [[nodiscard]] LaserSimulationOptions options(const std::string& name, int threads = 1) const {
    LaserSimulationOptions options{params_, folder_ / name, {}};
    options.run.threads = threads;
    return options;
  }

  static std::map<std::string, std::string> contents(const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      std::ifstream file(entry.path(), std::ios::binary);
      files[fs::relative(entry.path(), folder).string()] = {std::istreambuf_iterator<char>(file), {}};
    }
    return files;
  }

  TemporaryFolder temporary_;
  fs::path folder_ = temporary_.path();
  LaserSimulationParams params_;
};

TEST_F(LaserSimulationRecording, IsReadBackAsItWasFlown) {
  const auto summary = simulate_laser_recording(options("a", 2));
  ASSERT_TRUE(summary) << to_string(summary.error());
  for (const fs::path& path : summary->outputs) EXPECT_TRUE(fs::exists(path)) << path;
  const LaserSimulation simulation(params_);
  const auto recording = open_laser_recording(folder_ / "a");
  ASSERT_TRUE(recording) << to_string(recording.error());
  ASSERT_EQ(recording->lasers.size(), 1u);
  const LaserStream& laser = recording->lasers.front();
  ASSERT_EQ(laser.scans.size(), 300u);
  ASSERT_EQ(laser.received.size(), 300u);
  for (const std::size_t i : {0u, 150u, 299u}) {
    const Received<LaserScan> expected = simulation.scan(i);
    const LaserScan& scan = laser.scans[i];
    EXPECT_EQ(scan.stamp, expected.measured.stamp);
    EXPECT_EQ(laser.received[i], expected.at);
    EXPECT_GT((laser.received[i] - scan.stamp).seconds(), 0.038);
    EXPECT_NEAR(scan.time_increment_s, expected.measured.time_increment_s, 1e-11);
    EXPECT_NEAR(scan.angle_rad(1080), expected.measured.angle_rad(1080), 1e-4);
    ASSERT_EQ(scan.size(), 1081u);
    for (std::size_t beam = 0; beam < 1081; ++beam) {
      const float range = expected.measured.ranges_m[beam];
      EXPECT_TRUE(scan.ranges_m[beam] == range || (std::isnan(range) && std::isnan(scan.ranges_m[beam])));
    }
  }
  const auto imu = simulation.imu();
  ASSERT_EQ(recording->imu.size(), imu.size());
  EXPECT_EQ(recording->imu[77].angular_velocity_rad_s, imu[77].measured.angular_velocity_rad_s);
  EXPECT_EQ(recording->imu[77].specific_force_m_s2, imu[77].measured.specific_force_m_s2);
  ASSERT_TRUE(recording->imu[77].R_world_imu);
  EXPECT_TRUE(recording->imu[77].R_world_imu->isApprox(*imu[77].measured.R_world_imu, 1e-9));
  EXPECT_EQ(recording->odometry.size(), simulation.odometry().size());
}

TEST_F(LaserSimulationRecording, HasRigAndTruth) {
  params_.scan_limit = 300;
  ASSERT_TRUE(simulate_laser_recording(options("a")));
  const LaserSimulation simulation(params_);
  const auto recording = open_laser_recording(folder_ / "a");
  ASSERT_TRUE(recording) << to_string(recording.error());
  ASSERT_TRUE(recording->rig);
  EXPECT_EQ(recording->rig->horizontal->begin, 56u);
  EXPECT_EQ(recording->rig->horizontal->end, 1025u);
  EXPECT_TRUE(recording->rig->down->T_base_virtual_laser.matrix().isApprox(
      simulation.rig().down->T_base_virtual_laser.matrix(), 1e-9));
  const Trajectory truth = simulation.truth();
  ASSERT_EQ(recording->truth.size(), truth.size());
  EXPECT_TRUE(recording->truth[200].T_world_base.matrix().isApprox(truth[200].T_world_base.matrix(), 1e-8));
  EXPECT_GT(static_cast<double>(truth.size()) / (truth.back().stamp - truth.front().stamp).seconds(), 100);

  std::ifstream floor(folder_ / "a" / "truth_floor.txt");
  std::string line;
  std::getline(floor, line);
  EXPECT_EQ(line.front(), '#');
  std::size_t lines = 0;
  double stamp = 0, height = 0, below = 0, above = 0;
  for (; floor >> stamp >> height >> below >> above; ++lines) {
    EXPECT_NEAR(stamp, truth.at(lines).stamp.seconds(), 1e-9);
    EXPECT_NEAR(height, truth[lines].T_world_base.translation().z(), 1e-8);
    EXPECT_LT(below, height);
    EXPECT_GT(above, height);
  }
  EXPECT_EQ(lines, truth.size());
}

/// The rig of a laser with 1080 beams is the one of the configuration.
TEST_F(LaserSimulationRecording, TheRigIsTheCityFlyers) {
  const auto file = read_laser_rig(test::source_folder() / "configs/city_flyer_rig.toml");
  ASSERT_TRUE(file) << to_string(file.error());
  const LaserRig rig = city_flyer_rig(1080);
  EXPECT_TRUE(rig.T_base_laser.matrix().isApprox(file->T_base_laser.matrix(), 1e-12));
  EXPECT_EQ(rig.horizontal->begin, file->horizontal->begin);
  EXPECT_EQ(rig.horizontal->end, file->horizontal->end);
  for (const auto& [mine, theirs] : {std::pair(rig.down, file->down), std::pair(rig.up, file->up)}) {
    EXPECT_EQ(mine->beams.begin, theirs->beams.begin);
    EXPECT_EQ(mine->beams.end, theirs->beams.end);
    EXPECT_TRUE(mine->T_base_virtual_laser.matrix().isApprox(theirs->T_base_virtual_laser.matrix(), 1e-9));
  }
}

TEST_F(LaserSimulationRecording, HasTheSameBytesForAnyNumberOfThreads) {
  ASSERT_TRUE(simulate_laser_recording(options("one")));
  ASSERT_TRUE(simulate_laser_recording(options("two", 2)));
  const auto one = contents(folder_ / "one");
  EXPECT_EQ(one.size(), 6u);
  EXPECT_TRUE(one == contents(folder_ / "two"));
  params_.seed = 2;
  ASSERT_TRUE(simulate_laser_recording(options("other")));
  EXPECT_NE(one.at("recording.bag"), contents(folder_ / "other").at("recording.bag"));
}

TEST_F(LaserSimulationRecording, RefusesBadParametersAndOccupiedFolders) {
  params_.scan_limit = 3;
  LaserSimulationOptions bad = options("a");
  bad.params.truth_rate_hz = 10;
  const auto refused = simulate_laser_recording(bad);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("truth_rate_hz"), std::string::npos);
  bad = options("a");
  bad.params.laser.range_min_m = 5, bad.params.laser.range_max_m = 4;
  EXPECT_FALSE(simulate_laser_recording(bad));
  EXPECT_FALSE(fs::exists(folder_ / "a"));

  ASSERT_TRUE(simulate_laser_recording(options("a")));
  const auto occupied = simulate_laser_recording(options("a"));
  ASSERT_FALSE(occupied);
  EXPECT_EQ(occupied.error().code, ErrorCode::kUsage);
  EXPECT_TRUE(open_laser_recording(folder_ / "a")) << "the recording that was there is gone";
  SimulationOptions camera;
  camera.output = folder_ / "a";
  camera.params.frame_limit = 1;
  EXPECT_FALSE(simulate_recording(camera));
  EXPECT_TRUE(open_laser_recording(folder_ / "a")) << "the recording that was there is gone";
  remove_simulation(folder_ / "a");
  EXPECT_FALSE(fs::exists(folder_ / "a"));
}

TEST_F(LaserSimulationRecording, ASecondOneIsRefusedWhileTheFirstRuns) {
  params_.scan_limit = 100;
  ASSERT_TRUE(simulate_laser_recording(options("whole")));
  LaserSimulationOptions first = options("a");
  std::size_t refused = 0, reports = 0;
  first.run.progress = [&](const Progress&) {
    ++reports;
    const auto second = simulate_laser_recording(options("a"));
    if (second) return;
    EXPECT_EQ(second.error().code, ErrorCode::kUsage);
    refused += second.error().message.find("another run writes into this folder now") != std::string::npos;
  };
  const auto summary = simulate_laser_recording(first);
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_GE(reports, 2u);
  EXPECT_EQ(refused, reports);
  EXPECT_TRUE(contents(folder_ / "a") == contents(folder_ / "whole"));
}

TEST_F(LaserSimulationRecording, LeavesNothingWhenItIsStoppedAndReplacesWhatAKilledOneLeft) {
  for (const std::string_view stage : {"flying", "writing the truth"}) {
    std::stop_source source;
    LaserSimulationOptions stopped = options("a", 2);
    stopped.run.stop = source.get_token();
    stopped.run.progress = [&](const Progress& progress) {
      EXPECT_TRUE(fs::exists(folder_ / "a" / "simulation.unfinished.toml"));
      if (progress.stage == stage) source.request_stop();
    };
    const auto summary = simulate_laser_recording(stopped);
    ASSERT_FALSE(summary);
    EXPECT_EQ(summary.error().code, ErrorCode::kCancelled);
    EXPECT_FALSE(fs::exists(folder_ / "a"));
  }
  fs::create_directories(folder_ / "killed");
  std::ofstream(folder_ / "killed/recording.bag.partial") << "#ROSBAG V2.0\n";
  std::ofstream(folder_ / "killed/simulation.unfinished.toml") << "[laser_simulation]\n";
  ASSERT_TRUE(simulate_laser_recording(options("killed")));
  EXPECT_EQ(contents(folder_ / "killed").size(), 6u);
}

}  // namespace
}  // namespace hm
