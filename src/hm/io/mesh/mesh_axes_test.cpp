#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gtest/gtest.h>

#include <assimp/Importer.hpp>
#include <fstream>

#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/mesh/mesh_test_support.hpp"
#include "hm/io/testing/io_test_support.hpp"

namespace hm {
namespace {

using test::make_sheet;
using test::Parts;

const std::vector<UpDirection>& directions() {
  static const std::vector<UpDirection> kDirections{
      z_is_up(),
      UpDirection{-Vec3::UnitY(), UpSource::kFloorAndWalls, 0.01},
      UpDirection{Vec3::UnitY(), UpSource::kGravity, 0.01},
      UpDirection{-Vec3::UnitZ(), UpSource::kFloorAndWalls, 0.01},
      UpDirection{-Vec3::UnitX(), UpSource::kFrame, 0},
      UpDirection{Vec3(0.0052, -0.8902, -0.4555).normalized(), UpSource::kGravityAndLevels, 0.01},
      UpDirection{},
  };
  return kDirections;
}

TEST(MeshAxes, EveryFormatSaysWhereUpIsAndComesBackToItsFrame) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = make_sheet(21, Parts::kAll);
  for (const char* name : {"m.ply", "m.obj", "m.glb"})
    for (const UpDirection& up : directions()) {
      SCOPED_TRACE(std::string(name) + " " + to_string(up));
      MeshWriteOptions options;
      options.up = up;
      ASSERT_TRUE(write_mesh(folder / name, mesh, options));
      const auto said = read_mesh_up(folder / name);
      ASSERT_TRUE(said) << to_string(said.error());
      ASSERT_TRUE(*said);
      EXPECT_EQ(to_string(**said), to_string(up));
      const auto read = read_mesh(folder / name);
      ASSERT_TRUE(read) << to_string(read.error());
      ASSERT_EQ(read->vertices.size(), mesh.vertices.size());
      for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        EXPECT_LT((read->vertices[i] - mesh.vertices[i]).norm(), 1e-6F * (1 + mesh.vertices[i].norm()));
        EXPECT_LT((read->normals[i] - mesh.normals[i]).norm(), 1e-4F);
      }
    }
}

/// Independently: whatever the frame, viewers of glTF find up at y; where it is unknown, the frame as it is.
TEST(MeshAxes, ViewersFindUpAtY) {
  const TemporaryFolder folder;
  for (const UpDirection& up : directions()) {
    TriangleMesh mesh;
    const Vec3 across = up.up.unitOrthogonal();
    mesh.vertices = {Eigen::Vector3f::Zero(), across.cast<float>(), up.up.cast<float>()};
    mesh.triangles = {{0, 1, 2}};
    MeshWriteOptions options;
    options.up = up;
    ASSERT_TRUE(write_mesh(folder / "m.glb", mesh, options));
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile((folder / "m.glb").string(), aiProcess_PreTransformVertices);
    ASSERT_NE(scene, nullptr) << importer.GetErrorString();
    const aiVector3D& top = scene->mMeshes[0]->mVertices[2];
    const Vec3 seen(top.x, top.y, top.z);
    EXPECT_LT((seen - (up.known() ? Vec3(Vec3::UnitY()) : up.up)).norm(), 1e-6) << to_string(up);
  }
}

TEST(MeshAxes, OtherProgramsFiles) {
  const TemporaryFolder folder;
  std::ofstream(folder / "m.ply")
      << "ply\nformat ascii 1.0\ncomment up is where the sky is\nelement vertex 0\n"
         "property float x\nproperty float y\nproperty float z\nend_header\n";
  std::ofstream(folder / "m.obj") << "v 0 0 0\n";
  for (const char* name : {"m.ply", "m.obj"}) {
    const auto said = read_mesh_up(folder / name);
    ASSERT_TRUE(said);
    EXPECT_FALSE(*said) << name;
  }
  EXPECT_FALSE(read_mesh_up(folder / "none.ply"));
  std::ofstream(folder / "m.glb") << "glTF";
  EXPECT_FALSE(read_mesh_up(folder / "m.glb"));
}

}  // namespace
}  // namespace hm
