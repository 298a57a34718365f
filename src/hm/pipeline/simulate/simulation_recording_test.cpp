#include "hm/pipeline/simulate/simulation_recording.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>

#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/pipeline/simulate/simulate_parameter_list.hpp"
#include "hm/pipeline/simulate/simulation_folder.hpp"
#include "hm/sim/world/room_scene.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

class SimulationRecording : public ::testing::Test {
 protected:
  void SetUp() override {
    params_.world = WorldKind::kRoom;
    params_.frame_limit = 19;
    params_.frame_stride = 12;
    params_.pose_drift = true;
    params_.drift_ratio = 0.05;
    params_.truth_spacing_m = 0.1;
  }

  [[nodiscard]] SimulationOptions options(const std::string& name, int threads = 1) const {
    SimulationOptions options{params_, folder_ / name, {}};
    options.run.threads = threads;
    return options;
  }

  static std::map<std::string, std::string> contents(const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      std::ifstream file(entry.path(), std::ios::binary);
      files[fs::relative(entry.path(), folder).string()] = {std::istreambuf_iterator<char>(file), {}};
    }
    return files;
  }

  TemporaryFolder temporary_;
  fs::path folder_ = temporary_.path();
  SimulationParams params_;
};

TEST_F(SimulationRecording, IsReadBackAsItWasSimulated) {
  std::size_t reports = 0;
  SimulationOptions watched = options("a", 2);
  watched.run.progress = [&](const Progress& progress) { reports += progress.stage == "simulating"; };
  const auto summary = simulate_recording(watched);
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_EQ(summary->frames, 19u);
  EXPECT_GE(reports, 2u);
  EXPECT_GT(summary->valid_ratio, 0.5);
  EXPECT_LE(summary->valid_ratio, 1.0);
  EXPECT_GT(summary->end_drift_m, 0.0);
  for (const fs::path& path : summary->outputs) EXPECT_TRUE(fs::exists(path)) << path;

  const Simulation simulation(params_);
  const auto recording = open_recording(folder_ / "a");
  ASSERT_TRUE(recording) << to_string(recording.error());
  ASSERT_EQ((*recording)->info().frame_count, 19u);
  EXPECT_EQ((*recording)->info().camera.fx, simulation.camera().fx);
  for (const std::size_t i : {0u, 7u, 18u}) {
    const auto frame = (*recording)->read(i);
    ASSERT_TRUE(frame) << to_string(frame.error());
    const RgbdFrame expected = simulation.frame(i);
    EXPECT_TRUE(std::ranges::equal(frame->depth.units.pixels(), expected.depth.units.pixels()));
    EXPECT_NEAR(frame->depth.unit_m, kSimulatedDepthUnit_m, 1e-12);
    EXPECT_TRUE(std::ranges::equal(frame->color.pixels(), expected.color.pixels()));
    EXPECT_EQ(frame->stamp, expected.stamp);
  }
  const auto truth = read_trajectory(folder_ / "a" / "groundtruth.txt");
  const auto reported = read_trajectory(folder_ / "a" / "poses.txt");
  ASSERT_TRUE(truth && reported);
  ASSERT_EQ(truth->size(), 19u);
  for (std::size_t i = 0; i < 19; ++i) {
    EXPECT_TRUE(truth->at(i).T_world_base.matrix().isApprox(simulation.true_pose(i).matrix(), 1e-8));
    EXPECT_TRUE(reported->at(i).T_world_base.matrix().isApprox(simulation.reported_pose(i).matrix(), 1e-8));
  }
}

TEST_F(SimulationRecording, WritesTheTruth) {
  const auto summary = simulate_recording(options("a"));
  ASSERT_TRUE(summary) << to_string(summary.error());
  const auto mesh = read_mesh(folder_ / "a" / "truth_mesh.ply");
  ASSERT_TRUE(mesh) << to_string(mesh.error());
  EXPECT_NEAR(bounds(*mesh).sizes().x(), 6.3, 1e-5);
  EXPECT_TRUE(mesh->has_colors());
  const auto visible = read_mesh(folder_ / "a" / "truth_visible.ply");
  ASSERT_TRUE(visible) << to_string(visible.error());
  ASSERT_EQ(visible->vertices.size(), summary->truth_points);
  EXPECT_GT(summary->truth_points, 3000u);
  EXPECT_TRUE(visible->has_normals());
  for (const auto& p : visible->vertices) ASSERT_NEAR(room_sdf(p.cast<double>()), 0, 1e-4);
  EXPECT_TRUE(fs::exists(folder_ / "a" / "truth_scene.json"));

  SimulationParams again;
  ParamList list;
  list.add("simulation", again);
  const auto read = list.read_toml_file((folder_ / "a" / "simulation.toml").string());
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(again.frame_limit, 19);
  EXPECT_EQ(again.world, WorldKind::kRoom);
  EXPECT_TRUE(again.pose_drift);
}

TEST_F(SimulationRecording, WritesTheSizesOfItsFlaws) {
  ASSERT_TRUE(simulate_recording(options("a")));
  EXPECT_FALSE(fs::exists(folder_ / "a/flaws.toml"));
  params_.flaws = "people,wheel_slip,time_offset";
  params_.pose_drift = false;
  const auto summary = simulate_recording(options("b"));
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_TRUE(fs::exists(folder_ / "b/poses.txt"));
  FlawSizes read;
  read.flaws = *Flaws::parse(params_.flaws);
  ParamList list;
  list.add("flaws", read);
  const auto found = list.read_toml_file((folder_ / "b/flaws.toml").string());
  ASSERT_TRUE(found) << to_string(found.error());
  EXPECT_NEAR(read.color_delay_s, summary->flaws.color_delay_s, 1e-12);
  EXPECT_GT(read.color_delay_s, 0.004);
  EXPECT_EQ(read.people, summary->flaws.people);
  EXPECT_GT(read.people, 0);
}

TEST_F(SimulationRecording, AnUnknownFlawIsAnErrorBeforeAnythingIsWritten) {
  params_.flaws = "blur,glas";
  const auto refused = simulate_recording(options("a"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
  EXPECT_NE(refused.error().message.find("simulation.flaws names 'glas'; known are blur, rolling_shutter"),
            std::string::npos);
  EXPECT_NE(refused.error().message.find("rolling_shutter"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder_ / "a"));
}

TEST_F(SimulationRecording, TheOldNameOfTheRollingShutterLeadsToTheNewOne) {
  SimulateParameters parameters;
  ParamList list = list_simulation(parameters);
  const auto set = list.set("simulation.rolling_shutter=true");
  const auto read = list.read_toml("[simulation]\nrolling_shutter = true\n", "old.toml");
  ASSERT_FALSE(set || read);
  EXPECT_NE(set.error().message.find("'simulation.flaws'"), std::string::npos);
  EXPECT_NE(read.error().message.find("'simulation.flaws'"), std::string::npos);
}

TEST_F(SimulationRecording, HasTheSameBytesForAnyNumberOfThreads) {
  ASSERT_TRUE(simulate_recording(options("one")));
  ASSERT_TRUE(simulate_recording(options("two", 2)));
  const auto one = contents(folder_ / "one"), two = contents(folder_ / "two");
  EXPECT_GE(one.size(), 2 * 19u + 8);
  EXPECT_TRUE(one == two);
}

TEST_F(SimulationRecording, RefusesBadParametersAndOccupiedFolders) {
  SimulationOptions bad = options("a");
  bad.params.frame_stride = 0;
  const auto refused = simulate_recording(bad);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("frame_stride"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder_ / "a"));
  params_.frame_limit = 2;
  ASSERT_TRUE(simulate_recording(options("a")));
  const auto occupied = simulate_recording(options("a"));
  ASSERT_FALSE(occupied);
  EXPECT_EQ(occupied.error().code, ErrorCode::kUsage);
  EXPECT_TRUE(open_recording(folder_ / "a")) << "the recording that was there is gone";
}

TEST_F(SimulationRecording, LeavesNothingWhenItIsStopped) {
  fs::create_directories(folder_ / "mine");
  std::ofstream(folder_ / "mine/notes.txt") << "not yours\n";
  for (const char* name : {"new", "mine"}) {
    for (const std::string_view stage : {"simulating", "finding what can be seen of the truth"}) {
      std::stop_source source;
      SimulationOptions stopped = options(name, 2);
      stopped.run.stop = source.get_token();
      stopped.run.progress = [&](const Progress& progress) {
        EXPECT_TRUE(fs::exists(folder_ / name / "simulation.unfinished.toml"));
        if (progress.stage == stage) source.request_stop();
      };
      const auto summary = simulate_recording(stopped);
      ASSERT_FALSE(summary);
      EXPECT_EQ(summary.error().code, ErrorCode::kCancelled);
      EXPECT_NE(summary.error().message.find("nothing of it was kept"), std::string::npos);
    }
  }
  EXPECT_FALSE(fs::exists(folder_ / "new"));
  const auto left = contents(folder_ / "mine");
  ASSERT_EQ(left.size(), 1u);
  EXPECT_EQ(left.at("notes.txt"), "not yours\n");
}

TEST_F(SimulationRecording, ReplacesWhatAKilledOneLeft) {
  ASSERT_TRUE(simulate_recording(options("whole")));
  // As after a kill in the middle: the mark of an unfinished run, images, no lists.
  const fs::path killed = folder_ / "killed";
  fs::create_directories(killed / "depth");
  fs::create_directories(killed / "rgb");
  std::ofstream(killed / "depth/0.500000000.png") << "of another run";
  std::ofstream(killed / "simulation.unfinished.toml") << "[simulation]\n";
  const auto summary = simulate_recording(options("killed"));
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_TRUE(contents(killed) == contents(folder_ / "whole"));
}

TEST_F(SimulationRecording, ASecondOneIsRefusedWhileTheFirstRuns) {
  ASSERT_TRUE(simulate_recording(options("whole")));
  SimulationOptions first = options("a");
  std::size_t refused = 0, reports = 0;
  first.run.progress = [&](const Progress&) {
    ++reports;
    const auto second = simulate_recording(options("a"));
    if (second) return;
    EXPECT_EQ(second.error().code, ErrorCode::kUsage);
    EXPECT_FALSE(remove_simulation(folder_ / "a"));
    refused += second.error().message.find("another run writes into this folder now") != std::string::npos;
  };
  const auto summary = simulate_recording(first);
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_GE(reports, 3u);
  EXPECT_EQ(refused, reports);
  EXPECT_TRUE(contents(folder_ / "a") == contents(folder_ / "whole"));
}

TEST_F(SimulationRecording, RemovesOnlyItsOwn) {
  ASSERT_TRUE(simulate_recording(options("a")));
  remove_simulation(folder_ / "a");
  EXPECT_FALSE(fs::exists(folder_ / "a"));
  fs::create_directories(folder_ / "other/depth");  // a recording that nobody simulated
  std::ofstream(folder_ / "other/depth.txt") << "# depth maps\n";
  remove_simulation(folder_ / "other");
  EXPECT_TRUE(fs::exists(folder_ / "other/depth.txt"));
}

}  // namespace
}  // namespace hm
