// Reconstruction with given poses corrected by dense alignment (reconstruction.align).
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "hm/pipeline/dense/reconstruction.hpp"
#include "hm/pipeline/simulate/simulation_recording.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

/// A simulated recording whose poses drift.
class AlignedReconstruction : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new fs::path(fs::path(testing::TempDir()) / fmt::format("hm_aligned_{}", getpid()));
    fs::remove_all(*folder_);
    SimulationOptions simulation;
    simulation.params.world = WorldKind::kRoom;
    simulation.params.frame_limit = 40;
    simulation.params.frame_stride = 2;
    simulation.params.pose_drift = true;
    simulation.params.drift_ratio = 0.05;
    simulation.params.drift_yaw_rad_m = 0.02;
    simulation.output = *folder_ / "recording";
    simulation.run.threads = 2;
    ASSERT_TRUE(simulate_recording(simulation));
  }
  static void TearDownTestSuite() {
    fs::remove_all(*folder_);
    delete folder_;
  }
  static ReconstructionOptions options(const std::string& name, int threads) {
    ReconstructionOptions options;
    options.recording = *folder_ / "recording";
    options.output = *folder_ / name;
    options.parameters.reconstruction.align = true;
    options.parameters.reconstruction.pictures = false;
    options.parameters.mesh_error.samples = 5'000;
    options.run.threads = threads;
    return options;
  }
  static std::string bytes_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static fs::path* folder_;
};
fs::path* AlignedReconstruction::folder_ = nullptr;

TEST_F(AlignedReconstruction, TheSameBitsOnOneThreadOrTwoAndWhenResumed) {
  const auto whole = reconstruct(options("whole", 2));
  ASSERT_TRUE(whole) << to_string(whole.error());
  ASSERT_TRUE(whole->alignment);
  EXPECT_EQ(whole->alignment->accepted + whole->alignment->not_accepted, 39u);
  EXPECT_GT(whole->alignment->accepted, 30u);
  ASSERT_TRUE(whole->alignment->given_ate_m && whole->alignment->aligned_ate_m);
  ASSERT_TRUE(reconstruct(options("one_thread", 1)));
  auto part = options("resumed", 2);
  part.parameters.reconstruction.frame_limit = 17;
  ASSERT_TRUE(reconstruct(part));
  auto rest = options("resumed", 2);
  rest.existing = ExistingResult::kResume;
  const auto resumed = reconstruct(rest);
  ASSERT_TRUE(resumed) << to_string(resumed.error());
  EXPECT_EQ(resumed->alignment->accepted, whole->alignment->accepted);
  for (const char* other : {"one_thread", "resumed"})
    for (const char* file : {"trajectory.tum", "mesh.ply"})
      EXPECT_EQ(bytes_of(*folder_ / "whole" / file), bytes_of(*folder_ / other / file))
          << other << " " << file;
  EXPECT_THAT(bytes_of(*folder_ / "whole/report.html"), testing::HasSubstr("Alignment"));
}

TEST_F(AlignedReconstruction, ARunCannotBeResumedWithoutIt) {
  auto part = options("changed", 2);
  part.parameters.reconstruction.frame_limit = 5;
  ASSERT_TRUE(reconstruct(part));
  auto other = options("changed", 2);
  other.existing = ExistingResult::kResume;
  other.parameters.reconstruction.align = false;
  const auto refused = reconstruct(other);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, testing::HasSubstr("reconstruction.align = true"));
}

TEST_F(AlignedReconstruction, WarnsWhenMostFramesCannotBeAligned) {
  auto strict = options("strict", 2);
  strict.parameters.alignment.min_overlap_ratio = 1;
  const auto run = reconstruct(strict);
  ASSERT_TRUE(run) << to_string(run.error());
  EXPECT_GT(run->alignment->not_accepted, 20u);
  EXPECT_THAT(run->warnings, testing::Contains(testing::HasSubstr("could not be aligned to the map")));
}

}  // namespace
}  // namespace hm
