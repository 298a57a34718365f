#pragma once
#include <string>

#include "hm/core/json_value.hpp"
#include "hm/core/result.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/io/bytes/input_file.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/io/mesh/mesh_file.hpp"

namespace hm {

// One writer and one reader a format; mesh_file.cpp chooses. The mesh was checked: finite vertices, indices
// in range.

/// Text without line breaks, for comments in headers.
std::string one_line(std::string text);

void write_ply(OutputFile& file, const TriangleMesh& mesh, const MeshWriteOptions& options);
void write_obj(OutputFile& file, const TriangleMesh& mesh, const MeshWriteOptions& options);
/// An error when the mesh is beyond the format's 4 GiB.
Result<void> write_glb(OutputFile& file, const TriangleMesh& mesh, const MeshWriteOptions& options);

Result<TriangleMesh> read_ply(InputFile& file);
Result<TriangleMesh> read_obj(InputFile& file);
Result<TriangleMesh> read_glb(InputFile& file);

/// Rotation from the mesh's frame into that of a GLB file: `up` to y; none where up is unknown.
Mat3 gltf_rotation(const UpDirection& up);
/// Up as stored in a GLB (asset.extras): the rotation back into the mesh's frame, and up there. Without a
/// word that of z up.
struct GltfAxes {
  Mat3 R_mesh_gltf;
  UpDirection up;
};
GltfAxes gltf_axes(const JsonValue& document);
/// asset.extras of a file that is written.
JsonValue gltf_extras(const MeshWriteOptions& options);

}  // namespace hm
