#include "hm/mesh/pages/mesh_page.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "hm/core/rng.hpp"
#include "hm/mesh/mesh_test_support.hpp"
#include "hm/mesh/pages/page_changes.hpp"
#include "hm/mesh/whole_mesh.hpp"

namespace hm {
namespace {

using testing::fill;

constexpr double kVoxel_m = 0.02;
constexpr PageChanges::Clock::time_point kStart{};

/// A ball of 0.5 m across four pages a side.
struct Ball {
  Ball() : loop(1), grid(kVoxel_m, 1e-5), mesher(MeshParams{}, loop) {
    fill(grid, -40, 40,
         [](const Vec3& p) { return std::clamp((p - Vec3(0.01, 0.02, 0.03)).norm() - 0.5, -0.06, 0.06); });
    mesher.mark_all(grid);
    update();
  }
  void update() {
    updated.clear();
    append_updates(mesher, mesher.update(grid).updated, updated);
  }
  ParallelLoop loop;
  VolumeGrid grid;
  IncrementalMesher mesher;
  std::vector<MeshedVolume> updated;
};

std::vector<MeshPageCopy> pages_of(const Ball& ball) {
  PageChanges changes;
  changes.note(ball.updated, kStart);
  return changes.take_all(kVoxel_m);
}

using Steps = std::array<long, 3>;
Steps steps_of(const Eigen::Vector3f& at, const EncodedPage& page) {
  const Eigen::Vector3f steps = (at - page.origin_m) / page.quantum_m;
  return {std::lround(steps.x()), std::lround(steps.y()), std::lround(steps.z())};
}

/// Positions of the corners of all triangles, each triangle beginning with its least corner.
std::multiset<std::array<Steps, 3>> triangles_of(const TriangleMesh& mesh, const EncodedPage& page) {
  std::multiset<std::array<Steps, 3>> out;
  for (const auto& triangle : mesh.triangles) {
    std::array<Steps, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) corners[k] = steps_of(mesh.vertices[triangle[k]], page);
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    out.insert(corners);
  }
  return out;
}

std::set<Steps> open_vertices(const TriangleMesh& mesh, const EncodedPage& page) {
  std::set<Steps> out;
  for (const auto& edge : open_edges(mesh))
    for (const std::uint32_t vertex : edge) out.insert(steps_of(mesh.vertices[vertex], page));
  return out;
}

TEST(MeshPage, KeepsEveryTriangleWithinHalfAQuantum) {
  const Ball ball;
  const auto pages = pages_of(ball);
  ASSERT_GT(pages.size(), 7u);
  std::size_t triangles = 0;
  for (const MeshPageCopy& page : pages) {
    const TriangleMesh mesh = mesh_of(page);
    const EncodedPage fine = encode_page(page.key, mesh, kVoxel_m)[0];
    const auto decoded = decode_page(fine);
    ASSERT_TRUE(decoded);
    EXPECT_EQ(triangles_of(*decoded, fine), triangles_of(mesh, fine));
    triangles += mesh.triangles.size();
    EXPECT_NEAR(static_cast<double>(fine.quantum_m), kVoxel_m / 256, 1e-9);
  }
  EXPECT_EQ(triangles, ball.mesher.triangle_count());
}

TEST(MeshPage, KeepsNormalsAndColors) {
  TriangleMesh mesh;
  Rng rng(3);
  for (int i = 0; i < 300; ++i) {
    const Vec3 at(rng.uniform(), rng.uniform(), rng.uniform());
    const Vec3 normal(rng.uniform() - 0.5, rng.uniform() - 0.5, rng.uniform() - 0.5);
    mesh.vertices.emplace_back(at.cast<float>());
    mesh.normals.emplace_back(normal.normalized().cast<float>());
    mesh.colors.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i / 2), 7});
  }
  for (std::uint32_t i = 0; i < 300; i += 3) mesh.triangles.push_back({i, i + 1, i + 2});
  const EncodedPage page = encode_page({}, mesh, 0.05)[0];
  const TriangleMesh decoded = decode_page(page).value();
  ASSERT_EQ(decoded.vertices.size(), mesh.vertices.size());
  // Vertices come in the order of their first use; each has a red of its own or a green of its own.
  for (std::size_t i = 0; i < decoded.vertices.size(); ++i) {
    std::size_t source = 0;
    float nearest = 1e9F;
    for (std::size_t k = 0; k < mesh.vertices.size(); ++k)
      if (const float d = (mesh.vertices[k] - decoded.vertices[i]).norm(); d < nearest)
        nearest = d, source = k;
    EXPECT_LT(nearest, page.quantum_m);
    EXPECT_GT(decoded.normals[i].dot(mesh.normals[source]), 0.999F);
    EXPECT_EQ(decoded.colors[i].r, mesh.colors[source].r);
    EXPECT_EQ(decoded.colors[i].g, mesh.colors[source].g);
  }
}

TEST(MeshPage, CoarserLevelsKeepTheBorders) {
  const Ball ball;
  for (const MeshPageCopy& page : pages_of(ball)) {
    const auto levels = encode_page(page.key, mesh_of(page), kVoxel_m);
    const TriangleMesh fine = decode_page(levels[0]).value();
    for (std::size_t level = 1; level < kPageLevels; ++level) {
      const TriangleMesh coarse = decode_page(levels[level]).value();
      EXPECT_LE(coarse.triangles.size(), decode_page(levels[level - 1]).value().triangles.size());
      EXPECT_EQ(open_vertices(coarse, levels[level]), open_vertices(fine, levels[0]));
    }
    if (fine.triangles.size() > 1000) {
      EXPECT_LT(decode_page(levels[2]).value().triangles.size(), fine.triangles.size() / 4);
    }
  }
}

TEST(MeshPage, TrianglesThatReachFarGetCoarserPositions) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {30, 0, 0}, {0, 30, 0.5F}};
  mesh.triangles = {{0, 1, 2}};
  const EncodedPage page = encode_page({}, mesh, kVoxel_m)[0];
  const TriangleMesh decoded = decode_page(page).value();
  ASSERT_EQ(decoded.triangles.size(), 1u);
  EXPECT_LT(page.quantum_m, 0.002F);
  float farthest = 0;
  for (const auto& v : decoded.vertices) farthest = std::max(farthest, v.maxCoeff());
  EXPECT_NEAR(farthest, 30, page.quantum_m);
}

TEST(MeshPage, EmptyMeshesAndDamagedBytes) {
  for (const EncodedPage& level : encode_page({1, 2, 3}, {}, kVoxel_m)) EXPECT_EQ(level.indices, 0u);
  const Ball ball;
  EncodedPage page = encode_page(pages_of(ball)[0].key, mesh_of(pages_of(ball)[0]), kVoxel_m)[0];
  const EncodedPage whole = page;
  ASSERT_TRUE(decode_page(page));
  for (std::size_t length = 0; length < whole.vertex_bytes.size(); length += 37) {
    page.vertex_bytes.assign(whole.vertex_bytes.begin(),
                             whole.vertex_bytes.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_FALSE(decode_page(page));
  }
  Rng rng(1);
  for (int i = 0; i < 300; ++i) {
    page = whole;
    page.index_bytes[rng.below(static_cast<std::uint32_t>(page.index_bytes.size()))] ^=
        std::byte{1} << static_cast<int>(rng.below(8));
    (void)decode_page(page);  // an error or another mesh; nothing worse
  }
}

TEST(MeshPage, DividesAnyMesh) {
  const Ball ball;
  const TriangleMesh mesh = ball.mesher.whole_mesh();
  std::size_t triangles = 0;
  for (const MeshPagePart& part : divide_into_pages(mesh, kVoxel_m)) {
    triangles += part.mesh.triangles.size();
    const Eigen::Vector3f corner =
        Eigen::Vector3f(static_cast<float>(part.key.x), static_cast<float>(part.key.y),
                        static_cast<float>(part.key.z)) *
        0.64F;
    for (const auto& vertex : part.mesh.vertices) {
      EXPECT_GT((vertex - corner).minCoeff(), -0.03F);
      EXPECT_LT((vertex - corner).maxCoeff(), 0.67F);
    }
    EXPECT_EQ(part.mesh.normals.size(), part.mesh.vertices.size());
  }
  EXPECT_EQ(triangles, mesh.triangles.size());
}

TEST(PageChanges, CopiesAPageNoMoreOftenThanTheInterval) {
  Ball ball;
  PageChanges changes(std::chrono::milliseconds(500));
  const auto at = [](int ms) { return kStart + std::chrono::milliseconds(ms); };
  changes.note(ball.updated, kStart);
  const auto first = changes.take_due(kVoxel_m, kStart);
  ASSERT_GT(first.size(), 7u);
  EXPECT_EQ(first[0].version, 1u);
  changes.note(ball.updated, at(300));
  changes.note(ball.updated, at(400));
  EXPECT_TRUE(changes.take_due(kVoxel_m, at(400)).empty());
  EXPECT_EQ(changes.waiting(), first.size());
  const auto second = changes.take_due(kVoxel_m, at(500));
  ASSERT_EQ(second.size(), first.size());
  EXPECT_EQ(second[0].version, 2u);
  EXPECT_EQ(second[0].changed_at, at(300));  // the oldest change that the first copy does not have
  EXPECT_EQ(changes.waiting(), 0u);
}

TEST(PageChanges, APageWithoutTrianglesIsEmptyInTheEnd) {
  Ball ball;
  PageChanges changes;
  changes.note(ball.updated, kStart);
  const std::size_t pages = changes.take_all(kVoxel_m).size();
  std::vector<ChangedVolume> released;
  for (const VolumeKey key : ball.grid.sorted_keys()) {
    ball.grid.release(key);
    released.push_back({key, 63, true});
  }
  ball.mesher.mark_changed(released);
  ball.update();
  changes.note(ball.updated, kStart);
  const auto gone = changes.take_all(kVoxel_m);
  EXPECT_EQ(gone.size(), pages);
  for (const MeshPageCopy& page : gone) EXPECT_TRUE(page.volumes.empty() && mesh_of(page).triangles.empty());
}

}  // namespace
}  // namespace hm
