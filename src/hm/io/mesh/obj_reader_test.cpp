#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gmock/gmock.h>

#include <assimp/Importer.hpp>

#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/testing/io_test_support.hpp"
#include "hm/io/testing/real_data_test_support.hpp"

namespace hm {
namespace {

using test::write_bytes;
using testing::HasSubstr;

TEST(ObjReader, ReadsEveryFormOfFace) {
  const TemporaryFolder folder;
  write_bytes(folder / "m.obj",
              "# by hand\r\nmtllib a.mtl\no thing\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nv 0 1 0 # corner\nvt 0 0\n"
              "vn 0 0 1\nvn 0 0 -1\nusemtl stone\ns off\nf 1 2 3\nf 1/1 3/1 4/1\nf 1//1 2//1 3//1 4//1\n"
              "f -4/1/-2 -3/1/-2 -2/1/-2\nl 1 2\n");
  const auto read = read_mesh(folder / "m.obj");
  ASSERT_TRUE(read) << to_string(read.error());
  const std::vector<std::array<std::uint32_t, 3>> expected{
      {0, 1, 2}, {0, 2, 3}, {0, 1, 2}, {0, 2, 3}, {0, 1, 2}};
  EXPECT_EQ(read->triangles, expected);
  ASSERT_TRUE(read->has_normals());
  for (const auto& normal : read->normals) EXPECT_EQ(normal, Eigen::Vector3f::UnitZ());
  EXPECT_FALSE(read->has_colors());
}

TEST(ObjReader, AveragesNormalsThatDiffer) {
  const TemporaryFolder folder;
  write_bytes(folder / "m.obj",
              "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvn 1 0 0\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n");
  const auto read = read_mesh(folder / "m.obj");
  ASSERT_TRUE(read && read->has_normals());
  EXPECT_LT((read->normals[0] - Eigen::Vector3f(1, 0, 1).normalized()).norm(), 1e-6f);
  EXPECT_EQ(read->normals[1], Eigen::Vector3f::UnitZ());
  EXPECT_EQ(read->normals[3], Eigen::Vector3f::UnitX());
}

TEST(ObjReader, SaysWhatIsWrongAndWhere) {
  const TemporaryFolder folder;
  const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  struct Case {
    std::string text, message;
  };
  const std::vector<Case> cases{{three + "f 1 2 4\n", "m.obj:4: a face names vertex 4 of 3"},
                                {three + "f 1 2 0\n", "m.obj:4"},
                                {three + "f 1 2 -4\n", "m.obj:4"},
                                {three + "f 1 2\n", "a face of 2 corners"},
                                {three + "f 1//1 2//1 3//1\n", "m.obj:4: a face names normal 1 of 0"},
                                {three + "f 1 2 99999999999\n", "'99999999999'"},
                                {three + "v 1 nan 0\n", "'nan' is no finite number"},
                                {three + "v 1 0\n", "m.obj:4: a vertex of 2 numbers"}};
  for (const Case& bad : cases) {
    write_bytes(folder / "m.obj", bad.text);
    const auto read = read_mesh(folder / "m.obj");
    ASSERT_FALSE(read) << bad.text;
    EXPECT_THAT(to_string(read.error()), HasSubstr(bad.message)) << bad.text;
  }
}

TEST(ObjReader, ReadsRealMeshesLikeAssimp) {
  const std::filesystem::path data = real_data_folder();
  if (!std::filesystem::exists(data / "meshes"))
    GTEST_SKIP() << data / "meshes"
                 << " is not there";
  const TemporaryFolder folder;
  for (const auto& entry : std::filesystem::directory_iterator(data / "meshes")) {
    if (entry.path().extension() != ".obj") continue;
    SCOPED_TRACE(entry.path().string());
    const auto ours = read_mesh(entry.path());
    ASSERT_TRUE(ours) << to_string(ours.error());
    Assimp::Importer importer;
    const aiScene* scene =
        importer.ReadFile(entry.path().string(), aiProcess_Triangulate | aiProcess_PreTransformVertices);
    ASSERT_TRUE(scene) << importer.GetErrorString();
    std::size_t triangles = 0;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) triangles += scene->mMeshes[m]->mNumFaces;
    EXPECT_EQ(ours->triangles.size(), triangles);
    EXPECT_GT(triangles, 100u);
  }
}

}  // namespace
}  // namespace hm
