#include <fmt/format.h>

#include <cstring>
#include <string>

#include "hm/io/mesh/mesh_formats.hpp"

namespace hm {
namespace {

std::string ply_header(const TriangleMesh& mesh, const MeshWriteOptions& options) {
  std::string header = "ply\nformat binary_little_endian 1.0\n";
  header += fmt::format("comment made by {}\n", one_line(options.program));
  header += fmt::format("comment frame {}, right-handed\n", one_line(options.frame));
  header += fmt::format("comment up {}\n", to_string(options.up));
  header += "comment units metres\n";
  header += fmt::format("element vertex {}\n", mesh.vertices.size());
  for (const char* name : {"x", "y", "z"}) header += fmt::format("property float {}\n", name);
  if (mesh.has_normals())
    for (const char* name : {"nx", "ny", "nz"}) header += fmt::format("property float {}\n", name);
  if (mesh.has_colors())
    for (const char* name : {"red", "green", "blue"}) header += fmt::format("property uchar {}\n", name);
  header += fmt::format("element face {}\n", mesh.triangles.size());
  return header + "property list uchar int vertex_indices\nend_header\n";
}

}  // namespace

void write_ply(OutputFile& file, const TriangleMesh& mesh, const MeshWriteOptions& options) {
  file.write(ply_header(mesh, options));
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    std::array<char, 27> record;
    std::size_t size = 0;
    const auto append = [&](const void* bytes, std::size_t count) {
      std::memcpy(record.data() + size, bytes, count);
      size += count;
    };
    append(mesh.vertices[i].data(), 12);
    if (mesh.has_normals()) append(mesh.normals[i].data(), 12);
    if (mesh.has_colors()) append(&mesh.colors[i], 3);
    file.write(record.data(), size);
  }
  for (const auto& triangle : mesh.triangles) {
    std::array<char, 13> record{3};
    std::memcpy(record.data() + 1, triangle.data(), 12);
    file.write(record.data(), record.size());
  }
}

}  // namespace hm
