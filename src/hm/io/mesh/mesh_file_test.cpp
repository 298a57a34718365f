#include "hm/io/mesh/mesh_file.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <assimp/Importer.hpp>
#include <bit>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "hm/core/rng.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/mesh/mesh_test_support.hpp"
#include "hm/io/testing/io_test_support.hpp"

namespace hm {
namespace {

using test::expect_same;
using test::kAllParts;
using test::make_sheet;
using test::Parts;
using test::write_bytes;
using testing::HasSubstr;

constexpr std::array<const char*, 3> kExtensions{".ply", ".obj", ".glb"};

TEST(MeshFile, EveryFormatReadsBackBitForBit) {
  const TemporaryFolder folder;
  for (const char* extension : kExtensions)
    for (const Parts parts : kAllParts) {
      SCOPED_TRACE(fmt::format("{} {}", extension, static_cast<int>(parts)));
      const TriangleMesh mesh = make_sheet(37, parts);
      const auto path = folder / fmt::format("m{}", extension);
      const auto written = write_mesh(path, mesh);
      ASSERT_TRUE(written) << to_string(written.error());
      const auto read = read_mesh(path);
      ASSERT_TRUE(read) << to_string(read.error());
      expect_same(*read, mesh);
    }
  EXPECT_EQ(folder.file_count(), 3u);
}

TEST(MeshFile, EmptyMeshesAndLoosePointsAreFine) {
  const TemporaryFolder folder;
  TriangleMesh points = make_sheet(5, Parts::kColors);
  points.triangles.clear();
  for (const char* extension : {".PLY", ".obj", ".glb"}) {
    const auto path = folder / fmt::format("m{}", extension);
    for (const TriangleMesh& mesh : {TriangleMesh{}, points}) {
      ASSERT_TRUE(write_mesh(path, mesh));
      const auto read = read_mesh(path);
      ASSERT_TRUE(read) << to_string(read.error());
      expect_same(*read, mesh);
    }
  }
}

double linear(std::uint8_t srgb) {
  const double s = srgb / 255.0;
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

/// What assimp, an independent reader, makes of an export, corner by corner (it may renumber vertices).
void expect_assimp_agrees(const std::filesystem::path& path, const TriangleMesh& mesh) {
  const bool is_glb = path.extension() == ".glb";
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(path.string(), aiProcess_ValidateDataStructure);
  ASSERT_TRUE(scene) << importer.GetErrorString();
  ASSERT_EQ(scene->mNumMeshes, 1u);
  const aiMesh& theirs = *scene->mMeshes[0];
  ASSERT_EQ(theirs.mNumFaces, mesh.triangles.size());
  ASSERT_EQ(theirs.HasVertexColors(0), mesh.has_colors());
  ASSERT_EQ(theirs.HasNormals(), mesh.has_normals());
  const auto ours_from = [&](const aiVector3D& v) {
    return is_glb ? Eigen::Vector3f(v.x, -v.z, v.y) : Eigen::Vector3f(v.x, v.y, v.z);
  };
  for (unsigned f = 0; f < theirs.mNumFaces; ++f) {
    ASSERT_EQ(theirs.mFaces[f].mNumIndices, 3u);
    for (unsigned c = 0; c < 3; ++c) {
      const unsigned them = theirs.mFaces[f].mIndices[c];
      const std::uint32_t us = mesh.triangles[f][c];
      // assimp's OBJ reader is not exact in the last bits.
      ASSERT_LT((ours_from(theirs.mVertices[them]) - mesh.vertices[us]).norm(), 2e-6f);
      if (mesh.has_normals()) {
        ASSERT_LT((ours_from(theirs.mNormals[them]) - mesh.normals[us]).norm(), 2e-6f);
      }
      if (!mesh.has_colors()) continue;
      const aiColor4D& color = theirs.mColors[0][them];
      const Rgb8& expected = mesh.colors[us];
      const std::array<std::uint8_t, 3> bytes{expected.r, expected.g, expected.b};
      const std::array<float, 3> got{color.r, color.g, color.b};
      for (std::size_t i = 0; i < 3; ++i)
        ASSERT_NEAR(got[i], is_glb ? linear(bytes[i]) : bytes[i] / 255.0, is_glb ? 1.0 / 65535 : 6e-5);
    }
  }
}

TEST(MeshFile, AssimpReadsTheSame) {
  const TemporaryFolder folder;
  for (const char* extension : kExtensions)
    for (const Parts parts : kAllParts) {
      SCOPED_TRACE(fmt::format("{} {}", extension, static_cast<int>(parts)));
      const TriangleMesh mesh = make_sheet(20, parts);
      const auto path = folder / fmt::format("m{}", extension);
      ASSERT_TRUE(write_mesh(path, mesh));
      expect_assimp_agrees(path, mesh);
    }
}

TEST(MeshFile, HeadersSayFrameUnitsAndProgram) {
  const TemporaryFolder folder;
  const MeshWriteOptions options{.frame = "house\nframe", .program = "housemartin 1.2.3"};
  for (const char* extension : kExtensions) {
    const auto path = folder / fmt::format("m{}", extension);
    ASSERT_TRUE(write_mesh(path, make_sheet(3, Parts::kAll), options));
    const std::string bytes = test::read_bytes(path);
    EXPECT_THAT(bytes, HasSubstr("metres"));
    EXPECT_THAT(bytes, HasSubstr("housemartin 1.2.3"));
    EXPECT_TRUE(read_mesh(path));
  }
}

std::uint32_t word_at(const std::string& bytes, std::size_t offset) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + offset, 4);
  return word;
}

TEST(MeshFile, GlbKeepsTheRulesOfTheSpecification) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = make_sheet(9, Parts::kAll);
  ASSERT_TRUE(write_mesh(folder / "m.glb", mesh));
  const std::string bytes = test::read_bytes(folder / "m.glb");
  ASSERT_EQ(bytes.substr(0, 4), "glTF");
  ASSERT_EQ(word_at(bytes, 4), 2u);
  ASSERT_EQ(word_at(bytes, 8), bytes.size());
  const std::uint32_t json_bytes = word_at(bytes, 12);
  ASSERT_EQ(json_bytes % 4, 0u);
  ASSERT_EQ(bytes.substr(16, 4), "JSON");
  ASSERT_EQ(bytes.substr(20 + json_bytes + 4, 4), std::string("BIN\0", 4));
  const std::uint32_t binary_bytes = word_at(bytes, 20 + json_bytes);
  ASSERT_EQ(20 + json_bytes + 8 + binary_bytes, bytes.size());
  const auto json = parse_json(bytes.substr(20, json_bytes), "m.glb");
  ASSERT_TRUE(json);
  EXPECT_EQ(json->find("buffers")->as_array()->at(0).find("byteLength")->number_or(0), binary_bytes);
  const auto& views = *json->find("bufferViews")->as_array();
  for (const JsonValue& view : views) {
    EXPECT_EQ(*view.find("byteOffset")->as_integer() % 4, 0);
    EXPECT_TRUE(view.find("target"));
  }
  const JsonValue& primitive = json->find("meshes")->as_array()->at(0).find("primitives")->as_array()->at(0);
  const auto& accessors = *json->find("accessors")->as_array();
  const auto accessor = [&](const JsonValue* index) {
    return accessors.at(static_cast<std::size_t>(*index->as_integer()));
  };
  const JsonValue position = accessor(primitive.find("attributes")->find("POSITION"));
  Eigen::AlignedBox3f box;
  for (const auto& v : mesh.vertices) box.extend(Eigen::Vector3f(v.x(), v.z(), -v.y()));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    EXPECT_EQ(position.find("min")->as_array()->at(axis).number_or(0), double{box.min()[i]});
    EXPECT_EQ(position.find("max")->as_array()->at(axis).number_or(0), double{box.max()[i]});
  }
  const JsonValue indices = accessor(primitive.find("indices"));
  EXPECT_EQ(*indices.find("componentType")->as_integer(), 5125);
  EXPECT_EQ(*indices.find("count")->as_integer(), static_cast<std::int64_t>(mesh.triangles.size() * 3));
}

TEST(MeshFile, RefusesWhatCannotBeWritten) {
  const TemporaryFolder folder;
  TriangleMesh mesh = make_sheet(3, Parts::kAll);
  EXPECT_EQ(write_mesh(folder / "m.stl", mesh).error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(read_mesh(folder / "m.xyz").error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(read_mesh(folder / "m.ply").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(write_mesh(folder / "no/m.ply", mesh).error().code, ErrorCode::kUnreadable);
  mesh.vertices[4].y() = std::nanf("");
  const auto result = write_mesh(folder / "m.glb", mesh);
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("vertex 4"));
  EXPECT_EQ(folder.file_count(), 0u);
}

TEST(MeshFile, AFullDiskIsAnErrorAndKeepsTheOldFile) {
  const TemporaryFolder folder;
  const auto path = folder / "m.ply";
  ASSERT_TRUE(write_mesh(path, make_sheet(3, Parts::kAll)));
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{100'000, 100'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    ::_exit(write_mesh(path, make_sheet(150, Parts::kAll)) ? 1 : 0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_EQ(folder.file_count(), 1u);
  const auto read = read_mesh(path);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->vertices.size(), 9u);
}

TEST(MeshFile, EveryFormatSurvivesDamage) {
  const TemporaryFolder folder;
  for (const char* extension : kExtensions) {
    const auto path = folder / fmt::format("m{}", extension),
               damaged_path = folder / fmt::format("d{}", extension);
    ASSERT_TRUE(write_mesh(path, make_sheet(6, Parts::kAll)));
    int refused = 0;
    const int cases = test::for_each_damaged(test::read_bytes(path), 1000, [&](const std::string& damaged) {
      write_bytes(damaged_path, damaged);
      const auto read = read_mesh(damaged_path);
      refused += read ? 0 : 1;
      if (!read) {
        EXPECT_THAT(to_string(read.error()), HasSubstr(damaged_path.string()));
        return;
      }
      for (const auto& triangle : read->triangles)
        for (const std::uint32_t index : triangle) ASSERT_LT(index, read->vertices.size());
      for (const auto& vertex : read->vertices) ASSERT_TRUE(vertex.allFinite());
      ASSERT_TRUE(read->normals.empty() || read->has_normals());
      ASSERT_TRUE(read->colors.empty() || read->has_colors());
    });
    EXPECT_GT(refused, cases / 7) << extension;
  }
}

}  // namespace
}  // namespace hm
