#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/box.hpp"
#include "hm/geometry/level/up_direction.hpp"
#include "hm/io/map/map_file.hpp"
#include "hm/report/summary_tree.hpp"

namespace hm {

/// Kind of a path, from the file system, its extension and, of laser recordings, its first bytes.
enum class PathKind {
  kRecording,
  kLaserRecording,
  kResult,
  kMap,
  kOccupancy,
  kMesh,
  kTrajectory,
  kPoseGraph
};
/// An error when there is no such file or folder, or of no kind that this program reads.
Result<PathKind> kind_of(const std::filesystem::path& path);

/// Content of a map, for `hm info`.
struct MapReport {
  MapHeader header;
  std::uint64_t volumes = 0, volumes_with_color = 0, volumes_damaged = 0;
  std::uint64_t voxels_known = 0, voxels_inside = 0;
  std::uint64_t file_bytes = 0;
  Box3 bounds_m;
  UpDirection up;                                     ///< as the run that made it has found it
  std::size_t next_frame = 0, frames_integrated = 0;  ///< of the run that made it, when it is recorded
  std::vector<std::string> problems;
};
/// Reads all of a map; damaged parts are counted, not fatal.
Result<MapReport> inspect_map(const std::filesystem::path& path);
void visit(const MapReport& report, SummaryTree& v);
std::string to_text(const MapReport& report);

/// Content of a mesh, for `hm info`.
struct MeshReport {
  std::size_t vertices = 0, triangles = 0, open_edges = 0;
  bool has_normals = false, has_colors = false;
  double area_m2 = 0;
  double enclosed_volume_m3 = 0;  ///< meaningful only where there are no open edges
  Box3 bounds_m;
  std::uint64_t file_bytes = 0;
  std::optional<UpDirection> up;  ///< as the file says it; nothing: it does not
};
/// Up in the frame of a map, as the run that made it has found it; unknown where it says nothing.
UpDirection up_of_map(const MapHeader& header);
/// Reads all of a mesh (kMeshNames).
Result<MeshReport> inspect_mesh(const std::filesystem::path& path);
void visit(const MeshReport& report, SummaryTree& v);
std::string to_text(const MeshReport& report);

/// Content of a pose graph, for `hm info`.
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
void visit(const PoseGraphReport& report, SummaryTree& v);
std::string to_text(const PoseGraphReport& report);

}  // namespace hm
