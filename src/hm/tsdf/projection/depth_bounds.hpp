#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/tsdf/projection/projection_scan.hpp"

namespace hm {

/// Conservative depth bounds of a depth image where parts of a volume are projected, so that parts can be
/// skipped without reading pixels.
///
/// A part is a group of 16 voxels that are stored together (8 along x, 2 along y), 32 per volume. The box
/// around a part's voxel centres projects into a rectangle of the image, whose tiles have truncation bands
/// [near, far]. The extremes over any rectangle of tiles come from two adjacent windows, with widths that are
/// powers of two and heights from kHeights, all precomputed (like a sparse table of range minima).
class DepthBounds {
 public:
  /// Precomputes the bounds; keeps no references to the arguments.
  void build(const PreparedDepth& depth, const ProjectionScan& scan, const PinholeCamera& camera,
             const ParallelLoop& loop);

  /// Parts of the volume that may hold voxels of the hit region, and parts that may lie in front of it, where
  /// rays carve.
  [[nodiscard]] PartMasks parts_of(VolumeKey key) const;
  /// Removes volumes without any parts, testing whole volumes: much faster than parts_of(), but keeps more.
  void drop_unseen(std::vector<VolumeKey>& keys) const;

  // For the vector code:
  static constexpr int kWidths = 5;  ///< of windows: 1, 2, ... 16 tiles
  static constexpr std::array kHeights{1, 2, 3, 4, 6, 8, 12, 16};
  /// Band extremes: near in the low half, 65535 - far in the high half, so that both are minima; window
  /// (2^i x kHeights[j] tiles, cut off at the last row) at (x, y) is entry ((j * kWidths + i) * tiles_y + y)
  /// * tiles_x + x.
  std::vector<std::uint32_t> windows;
  int tiles_x = 0, tiles_y = 0;
  float units_per_m = 0;  ///< of the bands in `windows`
  /// Centres of the parts relative to the volume's first voxel: pixels from the principal point times metres,
  /// the same, metres.
  alignas(64) std::array<std::array<float, 32>, 3> part_centre{};
  Eigen::Vector3f part_extent = Eigen::Vector3f::Zero();  ///< half of a part's size, in the same form
  Eigen::Vector3f volume_centre = Eigen::Vector3f::Zero(), volume_extent = Eigen::Vector3f::Zero();
  Eigen::Vector2f principal_px = Eigen::Vector2f::Zero();
  Eigen::Vector2f size_px = Eigen::Vector2f::Zero();

 private:
  void fill_windows(const PreparedDepth& depth, const ParallelLoop& loop);
  [[nodiscard]] Eigen::Vector3f origin_of(VolumeKey key) const;  ///< in the form of part_centre

  ProjectionScan scan_;
};

}  // namespace hm
