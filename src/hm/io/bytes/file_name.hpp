#pragma once
#include <filesystem>
#include <string>

namespace hm {

/// Extension of a file name in lower case: ".ply" for "Scan.PLY".
std::string lower_extension(const std::filesystem::path& path);
/// True for the name of a mesh file: .ply .obj .glb
bool is_mesh_name(const std::filesystem::path& path);

}  // namespace hm
