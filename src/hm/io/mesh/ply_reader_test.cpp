#include <gmock/gmock.h>

#include <cstring>

#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/mesh/mesh_test_support.hpp"
#include "hm/io/testing/io_test_support.hpp"

namespace hm {
namespace {

using test::expect_same;
using test::make_sheet;
using test::Parts;
using test::write_bytes;
using testing::HasSubstr;

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

}  // namespace
}  // namespace hm
