#include "hm/io/mesh/mesh_file.hpp"

#include <algorithm>
#include <limits>

#include "hm/core/check.hpp"
#include "hm/io/bytes/file_name.hpp"
#include "hm/io/mesh/mesh_formats.hpp"
#include "hm/io/mesh/scene_reader.hpp"

namespace hm {
namespace {

Result<void> check_mesh(const TriangleMesh& mesh, const std::string& where) {
  HM_CHECK(mesh.normals.empty() || mesh.has_normals(), "{} normals, {} vertices", mesh.normals.size(),
           mesh.vertices.size());
  HM_CHECK(mesh.colors.empty() || mesh.has_colors(), "{} colours, {} vertices", mesh.colors.size(),
           mesh.vertices.size());
  if (mesh.vertices.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
    return fail(ErrorCode::kUnsupported, where, "{} vertices are more than mesh files hold",
                mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    if (!mesh.vertices[i].allFinite() || (mesh.has_normals() && !mesh.normals[i].allFinite()))
      return fail(ErrorCode::kInvalidValue, where, "vertex {} is not finite", i);
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t index : triangle)
      HM_CHECK(index < mesh.vertices.size(), "index {} of {} vertices", index, mesh.vertices.size());
  return {};
}

}  // namespace

std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

Result<void> write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh,
                        const MeshWriteOptions& options) {
  if (!is_written_mesh_name(path))
    return fail(ErrorCode::kUnsupported, path.string(), "meshes are written as {}", kWrittenMeshNames);
  const std::string extension = lower_extension(path);
  if (const auto sound = check_mesh(mesh, path.string()); !sound) return sound;
  OutputFile file(path);
  if (extension == ".ply") write_ply(file, mesh, options);
  if (extension == ".obj") write_obj(file, mesh, options);
  if (extension == ".glb")
    if (const auto written = write_glb(file, mesh, options); !written)
      return fail(written.error().code, path.string(), "{}", written.error().message);
  return file.finish();
}

Result<TriangleMesh> read_mesh(const std::filesystem::path& path) {
  if (!is_mesh_name(path))
    return fail(ErrorCode::kUnsupported, path.string(), "meshes are read from {}", kMeshNames);
  if (!is_written_mesh_name(path)) return read_scene(path);
  const std::string extension = lower_extension(path);
  auto file = InputFile::open(path);
  if (!file) return forward_error(file);
  if (extension == ".ply") return read_ply(*file);
  if (extension == ".obj") return read_obj(*file);
  auto mesh = read_glb(*file);
  // Node transforms, compression and the like, which our files do not have.
  return !mesh && mesh.error().code == ErrorCode::kUnsupported ? read_scene(path) : mesh;
}

}  // namespace hm
