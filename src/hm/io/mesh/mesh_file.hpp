#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "hm/core/result.hpp"
#include "hm/geometry/level/up_direction.hpp"
#include "hm/geometry/triangle_mesh.hpp"

namespace hm {

/// Metadata written to a mesh file.
struct MeshWriteOptions {
  std::string frame = "world";          ///< the name of the coordinate frame (metres)
  UpDirection up = z_is_up();           ///< in that frame; every format says it, a GLB is turned by it
  std::string program = "housemartin";  ///< name and version of the program that made it
};

/// Writes a mesh in the format of the path's extension: `.ply` (binary little endian), `.obj` (vertex colours
/// as `v x y z r g b`) or `.glb` (glTF 2.0, colours linear; turned so that `up` is y, as it is where up is
/// unknown). Normals and colours are written when the mesh has them. The mesh is streamed: memory use does
/// not depend on its size. The file appears whole or not at all. Errors: another extension, no place to
/// write, a vertex that is not finite, too large for the format.
Result<void> write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh,
                        const MeshWriteOptions& options = {});

/// Reads a mesh in the format of the path's extension, in the axes and units of write_mesh (a GLB is turned
/// back into the frame that it was written from; one of another program from y up to z up). Polygons become
/// fans of triangles.
///
///   .ply  ascii, binary little and big endian; float or double positions; normals, colours (integers, or
///   real
///         numbers from 0 to 1); everything else in the file is skipped
///   .obj  `v` (with colours), `vn`, `f` in every form, also with negative indices; where corners give a
///   vertex
///         different normals it gets their mean; materials and textures are skipped
///   .glb  triangles in float positions with optional normals, COLOR_0 and indices; anything else (node
///         transforms, sparse accessors, extensions) is left to assimp
///   .gltf .stl .off .dae .fbx
///         by assimp, in a process of its own (scene_reader.hpp); STL and OFF say neither axes nor units and
///         are taken as z up and metres
///
/// Errors name file and line or byte offset (not those of assimp). A file without triangles gives a mesh
/// without triangles, or an error where assimp reads it.
Result<TriangleMesh> read_mesh(const std::filesystem::path& path);

/// Up in the axes of read_mesh, as write_mesh has written it into the file. Nothing where the file does not
/// say it; z for a GLB of another program, which is y up by the format. Errors: no such file, another
/// extension.
Result<std::optional<UpDirection>> read_mesh_up(const std::filesystem::path& path);

}  // namespace hm
