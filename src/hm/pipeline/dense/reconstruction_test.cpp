#include "hm/pipeline/dense/reconstruction.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "hm/mapping/map_store.hpp"
#include "hm/pipeline/simulate/simulation_recording.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

/// A small simulated recording and a place for results, made once.
class Reconstruction : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new fs::path(fs::path(testing::TempDir()) / fmt::format("hm_reconstruction_{}", getpid()));
    fs::remove_all(*folder_);
    SimulationOptions simulation;
    simulation.params.world = WorldKind::kRoom;
    simulation.params.frame_limit = 24;
    simulation.output = *folder_ / "recording";
    simulation.run.threads = 2;
    const auto made = simulate_recording(simulation);
    ASSERT_TRUE(made) << to_string(made.error());
  }
  static void TearDownTestSuite() {
    fs::remove_all(*folder_);
    delete folder_;
  }

  static ReconstructionOptions options(const std::string& name) {
    ReconstructionOptions options;
    options.recording = *folder_ / "recording";
    options.output = *folder_ / name;
    options.parameters.tsdf.voxel_size_m = 0.03;
    options.parameters.reconstruction.pictures = false;
    options.parameters.reconstruction.save_interval_frames = 4;
    options.parameters.mesh_error.samples = 20'000;
    options.run.threads = 2;
    return options;
  }

  static std::string bytes_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  /// Every voxel of both maps, compared by bits.
  static void expect_same_map(const fs::path& a, const fs::path& b) {
    const auto file_a = MapFile::open(a, MapOpenMode::kRead), file_b = MapFile::open(b, MapOpenMode::kRead);
    ASSERT_TRUE(file_a && file_b);
    const auto grid_a = load_grid(*file_a), grid_b = load_grid(*file_b);
    ASSERT_TRUE(grid_a && grid_b);
    ASSERT_EQ(grid_a->sorted_keys(), grid_b->sorted_keys());
    for (const VolumeKey& key : grid_a->sorted_keys()) {
      const Volume *va = grid_a->find(key), *vb = grid_b->find(key);
      ASSERT_TRUE(std::equal(va->voxels, va->voxels + kVolumeVoxels, vb->voxels));
      ASSERT_EQ(va->colors == nullptr, vb->colors == nullptr);
      ASSERT_TRUE(!va->colors || std::equal(va->colors, va->colors + kVolumeVoxels, vb->colors));
    }
  }

  static fs::path* folder_;
};
fs::path* Reconstruction::folder_ = nullptr;

TEST_F(Reconstruction, StoppedAtEveryFrameAndResumedGivesTheSameBits) {
  const auto whole = reconstruct(options("whole"));
  ASSERT_TRUE(whole) << to_string(whole.error());
  EXPECT_EQ(whole->frames_integrated, 24u);
  EXPECT_FALSE(whole->interrupted);
  ASSERT_TRUE(whole->error);
  EXPECT_LT(whole->error->accuracy.distance_m.mean, 0.01);

  std::size_t runs = 0;
  for (bool interrupted = true; interrupted; ++runs) {
    ASSERT_LT(runs, 30u);
    std::stop_source stop;
    ReconstructionOptions piece = options("pieces");
    piece.existing = ExistingResult::kResume;
    piece.run.stop = stop.get_token();
    std::size_t frames_here = 0;  // each run is stopped after its third frame
    piece.run.progress = [&](const Progress& progress) {
      if (progress.stage == "reconstructing" && ++frames_here == 3) stop.request_stop();
    };
    const auto result = reconstruct(piece);
    ASSERT_TRUE(result) << to_string(result.error());
    interrupted = result->interrupted;
    EXPECT_EQ(result->frames_integrated, 3 * (runs + 1));
  }
  EXPECT_EQ(runs, 8u);
  expect_same_map(options("whole").output / "map.hmap", options("pieces").output / "map.hmap");
  for (const char* file : {"mesh.ply", "mesh.glb", "trajectory.tum"})
    EXPECT_EQ(bytes_of(options("whole").output / file), bytes_of(options("pieces").output / file)) << file;
}

TEST_F(Reconstruction, ThreadsBudgetsAndSavesDoNotChangeTheResult) {
  const auto reference = reconstruct(options("reference"));
  ASSERT_TRUE(reference);
  for (int variant = 0; variant < 3; ++variant) {
    ReconstructionOptions other = options(fmt::format("variant{}", variant));
    other.run.threads = variant == 0 ? 1 : 3;
    if (variant == 1) other.parameters.reconstruction.save_interval_frames = 1;
    if (variant == 1) other.parameters.reconstruction.mesh_budget_ms = 0.01;
    if (variant == 2) other.parameters.reconstruction.save_interval_frames = 0;
    if (variant == 2) other.parameters.reconstruction.live_mesh = false;
    ASSERT_TRUE(reconstruct(other));
    expect_same_map(options("reference").output / "map.hmap", other.output / "map.hmap");
    EXPECT_EQ(bytes_of(options("reference").output / "mesh.ply"), bytes_of(other.output / "mesh.ply"));
  }
}

TEST_F(Reconstruction, RangeOfFrames) {
  ReconstructionOptions some = options("some");
  some.parameters.reconstruction.begin_frame = 4;
  some.parameters.reconstruction.frame_stride = 3;
  some.parameters.reconstruction.frame_limit = 5;
  const auto result = reconstruct(some);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->frames_total, 5u);
  std::vector<std::size_t> indices;
  for (const FrameRecord& record : result->records) indices.push_back(record.index);
  EXPECT_THAT(indices, testing::ElementsAre(4, 7, 10, 13, 16));
}

TEST_F(Reconstruction, ProgressOfFindingUpReachesItsEnd) {
  for (const bool with_gap : {false, true}) {
    ReconstructionOptions late = options(with_gap ? "up_gap" : "up_late");
    late.parameters.reconstruction.level = true;
    late.parameters.reconstruction.begin_frame = 10;
    if (with_gap) {  // the last frames have no pose
      late.poses = *folder_ / "first_poses.txt";
      std::ifstream all(*folder_ / "recording/groundtruth.txt");
      std::ofstream first(late.poses);
      std::string line;
      for (int lines = 0; lines < 18 && std::getline(all, line); ++lines) first << line << '\n';
    }
    std::vector<std::size_t> done;
    std::size_t total = 0;
    late.run.progress = [&](const Progress& progress) {
      if (progress.stage != "finding up") return;
      done.push_back(progress.done);
      total = progress.total;
    };
    const auto result = reconstruct(late);
    ASSERT_TRUE(result) << to_string(result.error());
    ASSERT_FALSE(done.empty());
    EXPECT_EQ(total, 14u);
    EXPECT_EQ(done.back(), total);
    EXPECT_TRUE(std::is_sorted(done.begin(), done.end()));
    EXPECT_EQ(result->verdict.value != MapVerdict::kOk, with_gap);  // half of the frames are missing
  }
}

TEST_F(Reconstruction, ErrorsSayWhatIsWrong) {
  ReconstructionOptions nowhere = options("errors");
  nowhere.recording = *folder_ / "nowhere";
  EXPECT_FALSE(reconstruct(nowhere));

  ReconstructionOptions blind = options("errors");
  blind.parameters.tsdf.near_m = 50;
  blind.parameters.tsdf.far_m = 60;
  const auto result = reconstruct(blind);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kInvalidValue);
  EXPECT_THAT(result.error().message, testing::HasSubstr("not one of 24 frames"));

  std::stop_source stop;
  stop.request_stop();
  ReconstructionOptions stopped = options("errors");
  stopped.run.stop = stop.get_token();
  const auto cancelled = reconstruct(stopped);
  ASSERT_FALSE(cancelled);
  EXPECT_EQ(cancelled.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace hm
