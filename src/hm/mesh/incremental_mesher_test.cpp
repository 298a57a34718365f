#include "hm/mesh/incremental_mesher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "hm/mesh/marching_cubes.hpp"
#include "hm/mesh/mesh_test_support.hpp"
#include "hm/mesh/whole_mesh.hpp"

namespace hm {
namespace {

using testing::Lattice;

void expect_same(const TriangleMesh& a, const TriangleMesh& b) {
  ASSERT_EQ(a.vertices, b.vertices);
  ASSERT_EQ(a.normals, b.normals);
  ASSERT_EQ(a.colors, b.colors);
  ASSERT_EQ(a.triangles, b.triangles);
}

/// Collects changes as the integrator reports them: exactly the border layers with a changed voxel.
class Changes {
 public:
  void add(Lattice at) {
    ChangedVolume& changed = volumes_[testing::key_of(at)];
    changed.key = testing::key_of(at);
    for (int axis = 0; axis < 3; ++axis) {
      const int local = at[static_cast<std::size_t>(axis)] & 7;
      if (local == 0)
        changed.border_layers = static_cast<std::uint8_t>(changed.border_layers | 1 << (2 * axis));
      if (local == 7)
        changed.border_layers = static_cast<std::uint8_t>(changed.border_layers | 2 << (2 * axis));
    }
  }
  void release(VolumeKey key) { volumes_[key] = {key, 0, true}; }
  [[nodiscard]] std::vector<ChangedVolume> list() const {
    std::vector<ChangedVolume> result;
    for (const auto& [key, changed] : volumes_) result.push_back(changed);
    return result;
  }

 private:
  std::map<VolumeKey, ChangedVolume, ScanOrder> volumes_;
};

/// A grid of noise-free spheres that is edited at random.
struct Scene {
  VolumeGrid grid{0.02, 1e-5};
  Rng rng{3};

  Changes fill() {
    Changes changes;
    testing::fill(grid, -20, 20,
                  [](const Vec3& p) { return std::cos(18 * p.x()) + std::sin(15 * p.y()) + p.z(); });
    testing::for_each_voxel(-20, 20, [&](Lattice at) { changes.add(at); });
    return changes;
  }
  Lattice anywhere() {
    const auto one = [&] { return static_cast<int>(rng.below(44)) - 22; };
    return {one(), one(), one()};
  }
  void edit(Lattice at, Changes& changes) {
    const auto sdf = static_cast<std::int16_t>(static_cast<int>(rng.below(4001)) - 2000);
    testing::set_voxel(grid, at, rng.below(5) == 0 ? TsdfVoxel{} : TsdfVoxel::make(sdf, 300));
    if (rng.below(3) == 0) testing::set_color(grid, at, ColorVoxel{rng.next_u32()});
    changes.add(at);
  }
};

TEST(IncrementalMesher, SingleVoxelEditsGiveTheMeshFromScratch) {
  Scene scene;
  const ParallelLoop loop(1);
  IncrementalMesher mesher(MeshParams{}, loop);
  mesher.mark_changed(scene.fill().list());
  mesher.update(scene.grid);
  std::size_t meshed = 0;
  for (int round = 0; round < 150; ++round) {
    Changes changes;
    scene.edit(scene.anywhere(), changes);
    mesher.mark_changed(changes.list());
    meshed += mesher.update(scene.grid).volumes_meshed;
    expect_same(mesher.whole_mesh(), extract_mesh(scene.grid, MeshParams{}, loop));
    if (HasFatalFailure()) FAIL() << "round " << round;
  }
  EXPECT_LT(meshed, 150U * 6U);  // meshing all neighbours would take 27 for each
}

TEST(IncrementalMesher, ManyEditsAndReleasesGiveTheMeshFromScratch) {
  Scene scene;
  const ParallelLoop loop(2);
  IncrementalMesher mesher(MeshParams{}, loop);
  mesher.mark_changed(scene.fill().list());
  mesher.update(scene.grid);
  for (int round = 0; round < 30; ++round) {
    Changes changes;
    for (int i = 0; i < 40; ++i) scene.edit(scene.anywhere(), changes);
    const VolumeKey gone = testing::key_of(scene.anywhere());
    if (scene.grid.find(gone)) {
      scene.grid.release(gone);
      changes.release(gone);
    }
    mesher.mark_changed(changes.list());
    mesher.update(scene.grid);
    expect_same(mesher.whole_mesh(), extract_mesh(scene.grid, MeshParams{}, loop));
    if (HasFatalFailure()) FAIL() << "round " << round;
  }
}

TEST(IncrementalMesher, OnlyWhatChangedIsMeshed) {
  Scene scene;
  testing::fill(scene.grid, -16, 24,
                [](const Vec3& p) { return (p - Vec3(0.08, 0.08, 0.08)).norm() - 0.04; });
  const ParallelLoop loop(1);
  IncrementalMesher mesher(MeshParams{}, loop);
  mesher.mark_all(scene.grid);
  mesher.update(scene.grid);
  EXPECT_EQ(mesher.update(scene.grid).volumes_meshed, 0U);
  const auto meshed_after = [&](Lattice at) {
    Changes changes;
    scene.edit(at, changes);
    mesher.mark_changed(changes.list());
    return mesher.update(scene.grid).volumes_meshed;
  };
  EXPECT_EQ(meshed_after({4, 4, 4}), 1U);  // away from all borders
  EXPECT_EQ(meshed_after({7, 7, 7}), 1U);  // high layers are not read by neighbours without a surface there
  EXPECT_LE(meshed_after({0, 4, 3}), 2U);  // the volume at -x has cubes that end here
  EXPECT_LE(meshed_after({0, 0, 0}), 8U);
}

TEST(IncrementalMesher, ABudgetLeavesTheRestForLater) {
  Scene scene;
  const ParallelLoop loop(1);
  IncrementalMesher mesher(MeshParams{}, loop);
  mesher.mark_changed(scene.fill().list());
  const std::size_t all = mesher.waiting();
  ASSERT_GT(all, 150U);
  std::size_t meshed = 0, calls = 0;
  std::set<std::array<int, 3>> seen;
  while (mesher.waiting() > 0) {
    const MeshUpdateStats stats = mesher.update(scene.grid, 1e-6);  // one batch per call
    ASSERT_GT(stats.volumes_meshed, 0U);
    ASSERT_LT(stats.volumes_meshed, all);
    meshed += stats.volumes_meshed, ++calls;
    ASSERT_EQ(stats.volumes_waiting, all - meshed);
    ASSERT_EQ(stats.volumes_waiting, mesher.waiting());
    for (const VolumeKey key : stats.updated) EXPECT_TRUE(seen.insert({key.x, key.y, key.z}).second);
    ASSERT_FALSE(mesher.whole_mesh().vertices.empty());  // valid at any time
  }
  EXPECT_GE(calls, 3U);
  EXPECT_EQ(meshed, all);
  expect_same(mesher.whole_mesh(), extract_mesh(scene.grid, MeshParams{}, loop));
}

TEST(IncrementalMesher, LongestWaitingFirst) {
  Scene scene;
  const ParallelLoop loop(1);
  IncrementalMesher mesher(MeshParams{}, loop);
  scene.fill();
  std::vector<ChangedVolume> first, second;
  for (const VolumeKey key : scene.grid.sorted_keys())
    (key.z < 0 ? second : first).push_back({key, 0, false});
  ASSERT_GT(first.size(), 64U);
  mesher.mark_changed(first);
  mesher.mark_changed(second);
  for (const VolumeKey key : mesher.update(scene.grid, 1e-6).updated) EXPECT_GE(key.z, 0);
}

TEST(IncrementalMesher, SameBitsForAnyNumberOfThreads) {
  std::vector<TriangleMesh> results;
  for (const int threads : {1, 2, 2}) {
    Scene scene;
    const ParallelLoop loop(threads);
    IncrementalMesher mesher(MeshParams{}, loop);
    mesher.mark_changed(scene.fill().list());
    mesher.update(scene.grid);
    for (int round = 0; round < 5; ++round) {
      Changes changes;
      for (int i = 0; i < 30; ++i) scene.edit(scene.anywhere(), changes);
      mesher.mark_changed(changes.list());
      mesher.update(scene.grid);
    }
    results.push_back(mesher.whole_mesh());
  }
  expect_same(results[0], results[1]);
  expect_same(results[0], results[2]);
}

TEST(IncrementalMesher, CountsAndBytesFollowTheMeshes) {
  Scene scene;
  const ParallelLoop loop(1);
  IncrementalMesher mesher(MeshParams{}, loop);
  EXPECT_TRUE(mesher.whole_mesh().vertices.empty());
  mesher.mark_changed(scene.fill().list());
  const MeshUpdateStats stats = mesher.update(scene.grid);
  std::size_t vertices = 0, triangles = 0, bytes = 0;
  for (const VolumeMesh* mesh : mesher.volumes()) {
    EXPECT_EQ(mesher.find(mesh->key()), mesh);
    vertices += mesh->vertex_count(), triangles += mesh->triangle_count(), bytes += mesh->bytes();
  }
  EXPECT_EQ(mesher.vertex_count(), vertices);
  EXPECT_EQ(mesher.triangle_count(), triangles);
  EXPECT_EQ(stats.vertices_made, vertices);
  EXPECT_EQ(stats.triangles_made, triangles);
  EXPECT_EQ(stats.updated.size(), mesher.volumes().size());
  EXPECT_EQ(mesher.whole_mesh().triangles.size(), triangles);
  EXPECT_GE(mesher.bytes(), bytes);
  EXPECT_LT(bytes, vertices * 12);
  EXPECT_EQ(mesher.find({99, 0, 0}), nullptr);
}

TEST(IncrementalMesher, EverythingReleasedLeavesNothing) {
  Scene scene;
  const ParallelLoop loop(1);
  IncrementalMesher mesher(MeshParams{}, loop);
  mesher.mark_changed(scene.fill().list());
  mesher.update(scene.grid);
  std::vector<ChangedVolume> gone;
  for (const VolumeKey key : scene.grid.sorted_keys()) {
    gone.push_back({key, 0, true});
    scene.grid.release(key);
  }
  mesher.mark_changed(gone);
  EXPECT_GT(mesher.update(scene.grid).updated.size(), 0U);
  EXPECT_EQ(mesher.vertex_count(), 0U);
  EXPECT_EQ(mesher.triangle_count(), 0U);
  EXPECT_TRUE(mesher.volumes().empty());
  EXPECT_TRUE(mesher.whole_mesh().vertices.empty());
}

TEST(IncrementalMesher, VolumesThatComeAndGoDoNotAccumulate) {
  VolumeGrid grid(0.02, 1e-5);
  const ParallelLoop loop(1);
  IncrementalMesher mesher(MeshParams{}, loop);
  std::size_t most = 0, early = 0;
  for (int round = 0; round < 200; ++round) {  // a plane that moves away
    std::vector<ChangedVolume> changed;
    for (int i = 0; i < 100; ++i) {
      const VolumeKey key{100 * round + i, 0, 0};
      Volume* volume = grid.allocate(key);
      for (int v = 0; v < kVolumeVoxels; ++v)
        volume->voxels[v] = TsdfVoxel::make(static_cast<std::int16_t>((v >> 6) * 100 - 350), kWeightOne);
      changed.push_back({key, 63, false});
      if (round == 0) continue;
      changed.push_back({{key.x - 100, 0, 0}, 0, true});
      grid.release({key.x - 100, 0, 0});
    }
    mesher.mark_changed(changed);
    mesher.update(grid);
    ASSERT_EQ(mesher.volumes().size(), 100U);
    most = std::max(most, mesher.bytes());
    if (round == 30) early = most;
  }
  EXPECT_LE(most, 2 * early);
}

TEST(IncrementalMesher, MarkAllMeshesALoadedMap) {
  Scene scene;
  scene.fill();
  const ParallelLoop loop(1);
  IncrementalMesher mesher(MeshParams{}, loop);
  mesher.mark_all(scene.grid);
  EXPECT_EQ(mesher.update(scene.grid).volumes_meshed, scene.grid.volume_count());
  expect_same(mesher.whole_mesh(), extract_mesh(scene.grid, MeshParams{}, loop));
}

}  // namespace
}  // namespace hm
