#pragma once
#include <string>

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

}  // namespace hm
