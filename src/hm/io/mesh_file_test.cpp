#include "hm/io/mesh_file.hpp"

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
#include "hm/io/io_test_support.hpp"
#include "hm/io/json.hpp"

namespace hm {
namespace {

using test::TemporaryFolder;
using test::write_bytes;
using testing::HasSubstr;

enum class Parts { kBare, kNormals, kColors, kAll };
constexpr std::array kAllParts{Parts::kBare, Parts::kNormals, Parts::kColors, Parts::kAll};
constexpr std::array<const char*, 3> kExtensions{".ply", ".obj", ".glb"};

/// A wavy sheet whose vertices, normals and colours are all different from each other.
TriangleMesh make_sheet(int side, Parts parts) {
  TriangleMesh mesh;
  Rng rng(11);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const double z = std::sin(x * 0.7) * std::cos(y * 0.3) + 0.001 * rng.normal();
      mesh.vertices.emplace_back(Vec3(x * 0.1 - 3, y * 0.1 + 7, z).cast<float>());
      mesh.colors.push_back({static_cast<std::uint8_t>(x * 7), static_cast<std::uint8_t>(y * 5),
                             static_cast<std::uint8_t>(rng.below(256))});
    }
  for (int y = 0; y + 1 < side; ++y)
    for (int x = 0; x + 1 < side; ++x) {
      const auto i = static_cast<std::uint32_t>(y * side + x), s = static_cast<std::uint32_t>(side);
      mesh.triangles.push_back({i, i + 1, i + s + 1});
      mesh.triangles.push_back({i, i + s + 1, i + s});
    }
  compute_normals(mesh);
  if (parts == Parts::kBare || parts == Parts::kColors) mesh.normals.clear();
  if (parts == Parts::kBare || parts == Parts::kNormals) mesh.colors.clear();
  return mesh;
}

void expect_same(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.normals, b.normals);
  EXPECT_EQ(a.colors, b.colors);
  EXPECT_EQ(a.triangles, b.triangles);
}

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
  EXPECT_EQ(read_mesh(folder / "m.stl").error().code, ErrorCode::kUnsupported);
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
    test::for_each_damaged(test::read_bytes(path), 1000, [&](const std::string& damaged) {
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
    EXPECT_GT(refused, 300) << extension;
  }
}

// ---- PLY from others ----

TEST(PlyReader, ReadsAsciiWithExtraPropertiesAndPolygons) {
  const TemporaryFolder folder;
  write_bytes(
      folder / "m.ply",
      "ply\r\nformat ascii 1.0\r\ncomment by hand\r\nelement camera 1\r\nproperty list uchar float view\r\n"
      "element vertex 5\r\nproperty double x\r\nproperty double y\r\nproperty float quality\r\n"
      "property double z\r\nproperty float red\r\nproperty float green\r\nproperty float blue\r\n"
      "element face 2\r\nproperty uchar flags\r\nproperty list uchar uint vertex_index\r\nend_header\r\n"
      "2 0.5 0.25\r\n0 0 9 0 1 0 0\r\n1 0 9 0 0 1 0\r\n\r\n1 1 9 0 0 0 1\r\n0 1 9 0 0.5 2 -1\r\n"
      "-1e-3 +0.5 9 .25 0 0 0\r\n7 4 0 1 2 3\r\n7 3 0 3 4\r\n");
  const auto read = read_mesh(folder / "m.ply");
  ASSERT_TRUE(read) << to_string(read.error());
  ASSERT_EQ(read->vertices.size(), 5u);
  EXPECT_EQ(read->vertices[4], Eigen::Vector3f(-1e-3f, 0.5f, 0.25f));
  EXPECT_EQ(read->colors[1], (Rgb8{0, 255, 0}));
  EXPECT_EQ(read->colors[3], (Rgb8{128, 255, 0}));
  EXPECT_FALSE(read->has_normals());
  const std::vector<std::array<std::uint32_t, 3>> expected{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}};
  EXPECT_EQ(read->triangles, expected);
}

template <class T>
void append_big_endian(std::string& bytes, T value) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof value);
  for (auto byte = raw.rbegin(); byte != raw.rend(); ++byte) bytes.push_back(*byte);
}

TEST(PlyReader, ReadsBigEndian) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = make_sheet(8, Parts::kAll);
  std::string bytes =
      "ply\nformat binary_big_endian 1.0\nelement vertex 64\nproperty double x\nproperty double y\n"
      "property double z\nproperty float nx\nproperty float ny\nproperty float nz\n"
      "property ushort red\nproperty ushort green\nproperty ushort blue\nelement face 98\n"
      "property list int short vertex_indices\nproperty short material\nend_header\n";
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (const float v : mesh.vertices[i]) append_big_endian(bytes, static_cast<double>(v));
    for (const float v : mesh.normals[i]) append_big_endian(bytes, v);
    for (const auto c : {mesh.colors[i].r, mesh.colors[i].g, mesh.colors[i].b})
      append_big_endian(bytes, static_cast<std::uint16_t>(c * 257));
  }
  for (const auto& triangle : mesh.triangles) {
    append_big_endian(bytes, std::int32_t{3});
    for (const std::uint32_t index : triangle) append_big_endian(bytes, static_cast<std::int16_t>(index));
    append_big_endian(bytes, std::int16_t{-1});
  }
  write_bytes(folder / "m.ply", bytes);
  const auto read = read_mesh(folder / "m.ply");
  ASSERT_TRUE(read) << to_string(read.error());
  expect_same(*read, mesh);
}

TEST(PlyReader, SaysWhatIsWrongAndWhere) {
  const TemporaryFolder folder;
  const std::string head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n";
  const std::string faces =
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  struct Case {
    std::string text, message;
  };
  const std::vector<Case> cases{
      {"obj\n", "m.ply, byte 0"},
      {head + "end_header\n0 0\n0 0\n0 0\n", "no z"},
      {head + "property float z\n", "header does not end"},
      {head + "property flat z\nend_header\n", "m.ply:6"},
      {head + faces + "0 0 0\n0 0 x\n0 0 0\n3 0 1 2\n", "m.ply:11"},
      {head + faces + "0 0 0\n0 0 nan\n0 0 0\n3 0 1 2\n", "vertex 1 is not finite"},
      {head + faces + "0 0 0\n0 1 0\n1 0 0\n3 0 1 3\n", "vertex 3 of 3"},
      {head + faces + "0 0 0\n0 1 0\n1 0 0\n3 0 1\n", "face 0"},
      {head + faces + "0 0 0\n0 1 0\n1 0 0\n3 0 1 -2\n", "vertex -2"},
      {head + "property float z\nelement face 99999999999\n" + faces.substr(32), "do not fit"}};
  for (const Case& bad : cases) {
    write_bytes(folder / "m.ply", bad.text);
    const auto read = read_mesh(folder / "m.ply");
    ASSERT_FALSE(read) << bad.text;
    EXPECT_THAT(to_string(read.error()), HasSubstr(bad.message)) << bad.text;
  }
}

// ---- OBJ from others ----

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
  const char* given = std::getenv("HM_DATA");
  const std::filesystem::path data = given ? given : HM_SOURCE_DIR "/../shared/data";
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
