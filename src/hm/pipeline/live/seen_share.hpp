#pragma once
#include <bitset>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "hm/geometry/triangle_mesh.hpp"
#include "hm/pipeline/live/newest_jobs.hpp"
#include "hm/tsdf/grid/volume_snapshot.hpp"

namespace hm {

/// Where a mesh has surface, in cubes of 4 voxels: those that a vertex is in or nearer to than 2 voxels. Of
/// points along a line that goes through the mesh, 2 voxels apart, one is in such a cube.
class SurfaceCells {
 public:
  static constexpr int kCellVoxels = 4;

  explicit SurfaceCells(double voxel_size_m) : cell_m_(kCellVoxels * voxel_size_m) {}
  void mark(const TriangleMesh& mesh);
  /// Adds those of another one with voxels of the same size.
  void add(const SurfaceCells& other);
  /// Whether a line ends on a surface within `reach_m`.
  [[nodiscard]] bool is_hit(const Vec3& from_m, const Vec3& direction, double reach_m) const;

 private:
  using Block = std::bitset<512>;  ///< 8 x 8 x 8 cubes
  double cell_m_;
  std::map<VolumeKey, Block, PageOrder> blocks_;
};

/// Places along a path, `spacing_m` apart or more; with more than `most` of them the spacing is doubled.
std::vector<Vec3> places_along(std::span<const Eigen::Vector3f> path_m, double spacing_m, std::size_t most);

/// How much of what can be seen from a path has been seen: of lines from places along it in all directions,
/// the share that ends on the surface of the mesh within reach. Where a line goes through a hole, a window or
/// a space that was not looked into, it counts as not seen.
class SeenShare {
 public:
  static constexpr double kReach_m = 8, kSpacing_m = 1;
  static constexpr std::size_t kDirections = 256, kMostPlaces = 200;

  /// A page's surface as it is now; an empty mesh: none. Any thread.
  void set_page(VolumeKey page, const TriangleMesh& mesh, double voxel_size_m);
  /// Counts anew on another thread, for a path; returns at once.
  void count(std::vector<Eigen::Vector3f> path_m);
  void wait() { jobs_.wait(); }
  /// By the last count, from 0 to 1; nothing without a path or a mesh.
  [[nodiscard]] std::optional<double> share() const;

 private:
  mutable std::mutex mutex_;                            // guards the next two
  std::map<VolumeKey, SurfaceCells, PageOrder> cells_;  ///< by page
  std::optional<double> share_;
  NewestJobs<> jobs_;
};

}  // namespace hm
