#include "hm/io/mesh/scene_reader.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/core/testing/sanitized.hpp"
#include "hm/io/bytes/file_name.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/mesh/scene_test_support.hpp"
#include "hm/io/testing/io_test_support.hpp"

namespace hm {
namespace {

using test::scene_files;
using test::SceneFile;
using test::write_bytes;
using testing::HasSubstr;

/// The corners of the triangles, sorted: independent of how vertices are numbered.
std::vector<std::array<float, 9>> corners_of(const TriangleMesh& mesh) {
  std::vector<std::array<float, 9>> corners;
  for (const auto& triangle : mesh.triangles) {
    // The cyclic order is the orientation: begin with the least corner.
    std::array<std::array<float, 3>, 3> places{};
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t axis = 0; axis < 3; ++axis)
        places[c][axis] = std::round(1e4F * mesh.vertices[triangle[c]][static_cast<Eigen::Index>(axis)]);
    std::rotate(places.begin(), std::min_element(places.begin(), places.end()), places.end());
    corners.emplace_back();
    std::memcpy(corners.back().data(), places.data(), sizeof places);
  }
  std::sort(corners.begin(), corners.end());
  return corners;
}

TEST(SceneReader, ReadsATetrahedronInMetresAndZUpFromEveryFormat) {
  const TemporaryFolder folder;
  const std::vector<std::array<float, 9>> expected = corners_of(test::tetrahedron());
  ASSERT_GT(enclosed_volume(test::tetrahedron()), 0);
  for (const SceneFile& scene : scene_files()) {
    SCOPED_TRACE(scene.name);
    write_bytes(folder / scene.name, scene.bytes);
    const auto mesh = read_mesh(folder / scene.name);
    ASSERT_TRUE(mesh) << to_string(mesh.error());
    EXPECT_EQ(corners_of(*mesh), expected);
    EXPECT_EQ(mesh->vertices.size(), 4U);  // formats without shared vertices too
    EXPECT_TRUE(open_edges(*mesh).empty());
  }
}

TEST(SceneReader, NormalsAndColoursTurnWithTheirVertices) {
  const TemporaryFolder folder;
  const SceneFile scene = test::gltf_with_attributes();
  write_bytes(folder / scene.name, scene.bytes);
  const auto mesh = read_mesh(folder / scene.name);
  ASSERT_TRUE(mesh) << to_string(mesh.error());
  ASSERT_TRUE(mesh->has_normals() && mesh->has_colors());
  // Normal +y of glTF is +z here, also below a node that scales; linear 0.2158 is sRGB 128.
  for (const auto& normal : mesh->normals) EXPECT_LT((normal - Eigen::Vector3f::UnitZ()).norm(), 1e-6F);
  for (const Rgb8& color : mesh->colors) EXPECT_EQ(color, (Rgb8{255, 128, 0}));
}

TEST(SceneReader, SaysWhatIsWrongInWhichFile) {
  const TemporaryFolder folder;
  const std::vector<std::pair<std::string, std::string>> cases{
      {"a.stl", ""},         {"a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n"},
      {"a.dae", "<COLLADA"}, {"a.fbx", "; FBX"},
      {"a.gltf", "{}"},      {"points.off", "OFF\n2 0 0\n0 0 0\n1 0 0\n"}};
  for (const auto& [name, bytes] : cases) {
    write_bytes(folder / name, bytes);
    const auto mesh = read_mesh(folder / name);
    ASSERT_FALSE(mesh) << name;
    EXPECT_EQ(mesh.error().code, ErrorCode::kCorrupted) << name;
    EXPECT_THAT(to_string(mesh.error()), HasSubstr((folder / name).string()));
    EXPECT_FALSE(mesh.error().message.empty()) << name;
  }
  EXPECT_EQ(read_mesh(folder / "none.stl").error().code, ErrorCode::kNotFound);
  EXPECT_THAT(read_mesh(folder / "a.xyz").error().message, HasSubstr(kMeshNames));
}

TEST(SceneReader, AnFbxWithXUpIsRefused) {
  const TemporaryFolder folder;
  std::string bytes = test::fbx_tetrahedron();
  const std::string up = R"("UpAxis", "int", "Integer", "",2)";
  ASSERT_NE(bytes.find(up), std::string::npos);
  bytes[bytes.find(up) + up.size() - 1] = '0';
  write_bytes(folder / "x.fbx", bytes);
  const auto mesh = read_mesh(folder / "x.fbx");
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, ErrorCode::kUnsupported);
  EXPECT_THAT(mesh.error().message, HasSubstr("neither y nor z is up"));
}

TEST(SceneReader, DamagedFilesAreReadOrRefused) {
  const TemporaryFolder folder;
  Rng rng(7);
  const auto cuts = static_cast<std::uint32_t>(test::repetitions(30, 10));
  std::uint32_t refused = 0, cases = 0;
  for (const SceneFile& scene : scene_files()) {
    const auto size = static_cast<std::uint32_t>(scene.bytes.size());
    for (std::uint32_t i = 0; i < 2 * cuts; ++i, ++cases) {
      std::string damaged = scene.bytes;
      if (i < cuts) damaged.resize(size * i / cuts);
      for (std::uint32_t k = 0; i >= cuts && k < 1 + i % 4; ++k)
        damaged[rng.below(size)] = static_cast<char>(rng.below(256));
      write_bytes(folder / scene.name, damaged);
      const auto mesh = read_mesh(folder / scene.name);
      refused += mesh ? 0 : 1;
      if (!mesh) {
        EXPECT_THAT(to_string(mesh.error()), HasSubstr(scene.name));
        continue;
      }
      for (const auto& triangle : mesh->triangles)
        for (const std::uint32_t index : triangle) ASSERT_LT(index, mesh->vertices.size());
      for (const auto& vertex : mesh->vertices) ASSERT_TRUE(vertex.allFinite());
    }
  }
  EXPECT_GT(refused, cases / 5);
}

}  // namespace
}  // namespace hm
