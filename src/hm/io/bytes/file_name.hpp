#pragma once
#include <filesystem>
#include <string>

namespace hm {

/// The end of a file's name in lower case: ".ply" of "Scan.PLY".
std::string lower_extension(const std::filesystem::path& path);
/// Whether the name is that of a mesh file: .ply .obj .glb
bool is_mesh_name(const std::filesystem::path& path);

}  // namespace hm
