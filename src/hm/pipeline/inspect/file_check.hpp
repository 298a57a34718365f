#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/json_value.hpp"
#include "hm/core/result.hpp"
#include "hm/geometry/box.hpp"
#include "hm/io/map/map_file.hpp"

namespace hm {

/// What a path is, judged by the file system, its extension and, of laser recordings, its first bytes.
enum class PathKind { kRecording, kLaserRecording, kMap, kOccupancy, kMesh, kTrajectory, kPoseGraph };
/// An error when there is no such file or folder, or nothing that this program knows.
Result<PathKind> kind_of(const std::filesystem::path& path);

/// What `hm info` shows of a map.
struct MapReport {
  MapHeader header;
  std::uint64_t volumes = 0, volumes_with_color = 0, volumes_damaged = 0;
  std::uint64_t voxels_known = 0, voxels_inside = 0;
  std::uint64_t file_bytes = 0;
  Box3 bounds_m;
  std::size_t next_frame = 0, frames_integrated = 0;  ///< of the run that made it, when it says so
  std::vector<std::string> problems;
};
/// Reads all of a map; damaged parts are counted, not fatal.
Result<MapReport> inspect_map(const std::filesystem::path& path);
JsonValue to_json(const MapReport& report);
std::string to_text(const MapReport& report);

/// What `hm info` shows of a mesh.
struct MeshReport {
  std::size_t vertices = 0, triangles = 0, open_edges = 0;
  bool has_normals = false, has_colors = false;
  double area_m2 = 0;
  double enclosed_volume_m3 = 0;  ///< says something only where there are no open edges
  Box3 bounds_m;
  std::uint64_t file_bytes = 0;
};
/// Reads all of a mesh (.ply .obj .glb).
Result<MeshReport> inspect_mesh(const std::filesystem::path& path);
JsonValue to_json(const MeshReport& report);
std::string to_text(const MeshReport& report);

/// What `hm info` shows of a pose graph.
struct PoseGraphReport {
  int dimensions = 3;
  std::size_t nodes = 0, odometry_edges = 0, loop_edges = 0;
  std::size_t other_lines = 0;  ///< of kinds that are not read
  double path_length_m = 0;     ///< from node to node
  double chi2 = 0, largest_loop_chi2 = 0;
  std::vector<std::string> problems;
};
/// Reads a pose graph of the plane or of space (.g2o).
Result<PoseGraphReport> inspect_pose_graph(const std::filesystem::path& path);
JsonValue to_json(const PoseGraphReport& report);
std::string to_text(const PoseGraphReport& report);

}  // namespace hm
