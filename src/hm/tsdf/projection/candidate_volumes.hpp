#pragma once
#include <cstdint>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/geometry/box.hpp"
#include "hm/tsdf/projection/projection_scan.hpp"

namespace hm {

/// Input for finding the volumes near the surface.
struct BandQuery {
  const PreparedDepth& depth;
  const PinholeCamera& camera;
  const SE3& T_world_camera;
  double voxel_size_m = 0;
  TruncationModel truncation;
};

/// Finds the volumes intersected by the truncation bands of a depth image, from the depth instead of the
/// whole frustum (4.2.7). For each tile of pixels it takes the bounding box of its pyramid between (nearest
/// reading - truncation) and (farthest + truncation); tiles across a depth edge are split at the gaps between
/// their readings.
class CandidateFinder {
 public:
  /// Sets `keys` to all volumes that may hold a voxel of the hit region, i.e. within the truncation of its
  /// own pixel's reading, sorted by z, y, x. Returns false and no keys when the readings' bounding box needs
  /// a bitmap of more than kMostBitmapBytes.
  [[nodiscard]] bool find(const BandQuery& query, const ParallelLoop& loop, std::vector<VolumeKey>& keys);
  /// True for the volumes of the last find().
  [[nodiscard]] bool found(VolumeKey key) const;
  /// Number of volumes in the bounding box of the last find(), and the size of its bitmap.
  [[nodiscard]] double volumes_spanned() const { return volumes_spanned_; }
  [[nodiscard]] double bitmap_bytes() const { return bitmap_bytes_; }
  static constexpr double kMostBitmapBytes = 1024.0 * 1024 * 1024;

 private:
  struct Segment {
    float near_m, far_m;
  };
  void place_rays(const PreparedDepth& depth, const PinholeCamera& camera, const Mat3& R_world_camera_per_m);
  [[nodiscard]] bool place_bitmap(const PreparedDepth& depth, float widest_m);
  void mark_quad(const PreparedDepth& depth, int tile_x, int tile_y);
  void mark_tile(const PreparedDepth& depth, int tile_x, int tile_y);
  void mark_gapped_tile(const PreparedDepth& depth, int tile_x, int tile_y);
  /// Block of tiles: first tile and numbers of tiles.
  struct Tiles {
    int x, y, width, height;
  };
  void mark_segment(const Tiles& tiles, Segment segment);
  void mark_box(const Eigen::Array4f& low, const Eigen::Array4f& high);
  void collect(std::vector<VolumeKey>& keys);

  TruncationModel truncation_;
  // Four numbers each, the last unused: one vector register.
  Eigen::Array4f origin_ = Eigen::Array4f::Zero();  ///< camera, in volumes, relative to base_
  using Rays = std::vector<Eigen::Array4f, Eigen::aligned_allocator<Eigen::Array4f>>;
  Rays rays_;  ///< at tile corners, volumes per metre
  Rays columns_;
  int corners_x_ = 0;
  float volume_size_m_ = 1;
  VolumeKey base_;  ///< of bit 0
  int size_x_ = 0, size_y_ = 0, size_z_ = 0, words_x_ = 0;
  double volumes_spanned_ = 0, bitmap_bytes_ = 0;
  std::vector<std::uint64_t> bitmap_;
};

}  // namespace hm
