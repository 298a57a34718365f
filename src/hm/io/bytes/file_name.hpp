#pragma once
#include <filesystem>
#include <string>

namespace hm {

/// The end of a file's name in lower case: ".ply" of "Scan.PLY".
std::string lower_extension(const std::filesystem::path& path);

/// The ends of names of mesh files, for messages: those that write_mesh writes, and those that read_mesh
/// reads.
inline constexpr const char* kWrittenMeshNames = ".ply .obj .glb";
inline constexpr const char* kMeshNames = ".ply .obj .glb .gltf .stl .off .dae .fbx";
/// Whether the name ends in one of kWrittenMeshNames.
bool is_written_mesh_name(const std::filesystem::path& path);
/// Whether the name ends in one of kMeshNames.
bool is_mesh_name(const std::filesystem::path& path);

}  // namespace hm
