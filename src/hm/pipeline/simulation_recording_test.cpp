#include "hm/pipeline/simulation_recording.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>

#include "hm/io/mesh_file.hpp"
#include "hm/io/recording.hpp"
#include "hm/io/trajectory_file.hpp"
#include "hm/sim/room_scene.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

class SimulationRecording : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "hm_simulation_XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    params_.world = WorldKind::kRoom;
    params_.frame_limit = 19;
    params_.frame_stride = 12;
    params_.pose_drift = true;
    params_.drift_ratio = 0.05;
    params_.truth_spacing_m = 0.1;
  }
  void TearDown() override { fs::remove_all(folder_); }

  static std::map<std::string, std::string> contents(const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      std::ifstream file(entry.path(), std::ios::binary);
      files[fs::relative(entry.path(), folder).string()] = {std::istreambuf_iterator<char>(file), {}};
    }
    return files;
  }

  fs::path folder_;
  SimulationParams params_;
};

TEST_F(SimulationRecording, IsReadBackAsItWasSimulated) {
  std::size_t reports = 0;
  const auto count = [&](const Progress& progress) { reports += progress.stage == "simulate"; };
  const auto summary = simulate_recording(params_, folder_ / "a", count, 2);
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
  const auto summary = simulate_recording(params_, folder_ / "a", {}, 1);
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
  list.add("sim", again);
  const auto read = list.read_toml_file((folder_ / "a" / "simulation.toml").string());
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(again.frame_limit, 19);
  EXPECT_EQ(again.world, WorldKind::kRoom);
  EXPECT_TRUE(again.pose_drift);
}

TEST_F(SimulationRecording, HasTheSameBytesForAnyNumberOfThreads) {
  ASSERT_TRUE(simulate_recording(params_, folder_ / "one", {}, 1));
  ASSERT_TRUE(simulate_recording(params_, folder_ / "two", {}, 2));
  const auto one = contents(folder_ / "one"), two = contents(folder_ / "two");
  EXPECT_GE(one.size(), 2 * 19u + 8);
  EXPECT_TRUE(one == two);
}

TEST_F(SimulationRecording, RefusesBadParametersAndOccupiedFolders) {
  SimulationParams bad = params_;
  bad.frame_stride = 0;
  const auto refused = simulate_recording(bad, folder_ / "a", {}, 1);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("frame_stride"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder_ / "a"));
  params_.frame_limit = 2;
  ASSERT_TRUE(simulate_recording(params_, folder_ / "a", {}, 1));
  const auto occupied = simulate_recording(params_, folder_ / "a", {}, 1);
  ASSERT_FALSE(occupied);
  EXPECT_EQ(occupied.error().code, ErrorCode::kUsage);
}

}  // namespace
}  // namespace hm
