#pragma once
#include <filesystem>
#include <string>

namespace hm {

/// Extension of a file name in lower case: ".ply" for "Scan.PLY".
std::string lower_extension(const std::filesystem::path& path);

/// File name extensions of meshes, for messages: those that write_mesh writes, and those that read_mesh
/// reads.
inline constexpr const char* kWrittenMeshNames = ".ply .obj .glb";
inline constexpr const char* kMeshNames = ".ply .obj .glb .gltf .stl .off .dae .fbx";
/// True for a name that ends in one of kWrittenMeshNames.
bool is_written_mesh_name(const std::filesystem::path& path);
/// True for a name that ends in one of kMeshNames.
bool is_mesh_name(const std::filesystem::path& path);

}  // namespace hm
