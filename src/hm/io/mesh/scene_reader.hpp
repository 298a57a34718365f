#pragma once
#include <filesystem>

#include "hm/core/result.hpp"
#include "hm/geometry/triangle_mesh.hpp"

namespace hm {

/// Reads the triangles of a scene file with assimp, in a process of its own (isolated_call.hpp): STL, OFF,
/// COLLADA, FBX, glTF, also with several meshes and node transforms. Axes become z up and lengths metres
/// where the format says what they are. Vertices of equal position become one: its normal is the mean of
/// theirs, its colour that of the first. Points and lines are left out. Errors: those of call_isolated;
/// damaged; no triangle.
Result<TriangleMesh> read_scene(const std::filesystem::path& path);

}  // namespace hm
