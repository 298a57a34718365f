#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "hm/core/check.hpp"
#include "hm/tsdf/projection_scan.hpp"

namespace hm {

/// Bounds on what a depth image shows where parts of a volume fall on it, so that they can be passed over
/// without looking at a pixel; always on the safe side.
///
/// A part is a group of 16 voxels that are stored together (8 along x, 2 along y): 32 of them in a volume.
/// Its footprint in the picture is bounded by a square around its centre, and the readings there by tile
/// extremes, which are spread over squares of growing size beforehand.
class DepthBounds {
 public:
  /// Refers to nothing of its arguments afterwards.
  void build(const PreparedDepth& depth, const ProjectionScan& scan, const PinholeCamera& camera);

  /// The parts of the volume that may hold voxels of the hit region, and those that may lie in front of the
  /// truncation band, where rays carve.
  [[nodiscard]] PartMasks parts_of(VolumeKey key) const;

  // For the vector code:
  /// Camera depths of the truncation bands within a square of tiles: [near, far], over a padded tile grid.
  struct Level {
    int radius_tiles = 0;
    std::vector<float> near_m, far_m;
  };
  static constexpr int kPad = 9;  ///< tiles around the picture; the outermost ring never sees anything
  std::array<std::array<float, 32>, 3> part_centre{};   ///< homogeneous, relative to the volume's first voxel
  Eigen::Vector3f part_half = Eigen::Vector3f::Zero();  ///< half extents of a part: pixels times metres, metres
  int stride = 0, rows = 0;                             ///< of the padded grid

 private:
  void fill_first_level(const PreparedDepth& depth, const TruncationModel& truncation);
  void spread(const Level& from, Level& to, int by_tiles);
  /// The level whose squares cover every part of this volume; nullptr when none does.
  [[nodiscard]] const Level* level_for(const Eigen::Vector3f& origin) const;

  std::vector<Level> levels_;
  std::size_t levels_built_ = 0;
  ProjectionScan scan_;
  Eigen::Vector2f principal_px_ = Eigen::Vector2f::Zero();
  Eigen::Vector3f volume_half_ = Eigen::Vector3f::Zero();    ///< the same of a volume's voxel centres
  Eigen::Vector3f volume_centre_ = Eigen::Vector3f::Zero();  ///< relative to its first voxel
  std::vector<float> scratch_near_, scratch_far_;
};

}  // namespace hm
