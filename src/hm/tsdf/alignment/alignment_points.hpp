#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/alignment/alignment_params.hpp"
#include "hm/tsdf/projection/depth_edges.hpp"
#include "hm/tsdf/tsdf_params.hpp"

namespace hm {

/// Arrays for vector code are zero-padded to multiples of this.
inline constexpr std::size_t kAlignmentLanes = 16;

/// Readings of a depth image used for alignment, coarsest grid first: the readings of a round are the first
/// `round_end[round]`. Also caches the map's distances around each reading while it stays within the same
/// eight voxels.
struct AlignmentPoints {
  std::vector<float> x_m, y_m, z_m;  ///< camera frame
  std::vector<float> variance_m2;    ///< of the reading's distance from the map's surface
  std::vector<float> share;  ///< weight of a reading that accounts for correlation with its neighbours
  std::vector<float> inverse_width;  ///< 1/m; inverse width of the robust function in the current round
  std::vector<std::size_t> round_end;

  std::vector<std::int32_t> cell_x, cell_y, cell_z;  ///< lowest of the eight voxels, kNoCell at first
  std::array<std::vector<std::int16_t>, 8> corners;  ///< distances in sdf units; see VoxelLookup
  static constexpr std::int32_t kNoCell = INT32_MIN;

  [[nodiscard]] std::size_t size() const { return x_m.size(); }
};

/// Selects readings of depth images.
class AlignmentSampler {
 public:
  AlignmentSampler(const AlignmentParams& params, const TsdfParams& tsdf, const DepthNoise& noise,
                   const PinholeCamera& camera);
  /// Selects the readings of an image; reuses the memory of `points`. Skips readings out of range, at depth
  /// edges, at grazing angles and next to pixels without a reading.
  void choose(const DepthImage& depth, AlignmentPoints& points) const;

 private:
  /// Pixels whose distance from the first one is a multiple of `stride` on both axes, and of `coarser`
  /// (chosen before; 0: none) not on both.
  struct Grid {
    int first_px, stride_px, coarser_px;
  };
  void choose_row(const EdgeRule& rule, const DepthImage& depth, int y, const Grid& grid,
                  AlignmentPoints& points) const;

  AlignmentParams params_;
  TsdfParams tsdf_;
  DepthNoise noise_;
  PinholeCamera camera_;
};

}  // namespace hm
