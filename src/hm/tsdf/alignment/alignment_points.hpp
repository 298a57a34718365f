#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/alignment/alignment_params.hpp"
#include "hm/tsdf/projection/depth_edges.hpp"
#include "hm/tsdf/projection/tsdf_params.hpp"

namespace hm {

/// Arrays for vector code are filled up with zeros to whole blocks of this many.
inline constexpr std::size_t kAlignmentLanes = 16;

/// The readings of a depth image that alignment uses, coarse grid first: those of a stride are the first
/// `round_end` of all. Beside them what the map says around each, kept from one iteration to the next while
/// the reading stays within the same eight voxels.
struct AlignmentPoints {
  std::vector<float> x_m, y_m, z_m;  ///< camera frame
  std::vector<float> variance_m2;    ///< of the reading's distance from the map's surface
  std::vector<float> share;          ///< how much of a reading counts, as it errs with its neighbours
  std::vector<float> inverse_width;  ///< 1/m; where the robust function ends, for the round under way
  std::vector<std::size_t> round_end;

  std::vector<std::int32_t> cell_x, cell_y, cell_z;  ///< lowest of the eight voxels, kNoCell at first
  std::array<std::vector<std::int16_t>, 8> corners;  ///< distances in sdf units; see VoxelLookup
  static constexpr std::int32_t kNoCell = INT32_MIN;

  [[nodiscard]] std::size_t size() const { return x_m.size(); }
};

/// Chooses readings of depth images.
class AlignmentSampler {
 public:
  AlignmentSampler(const AlignmentParams& params, const TsdfParams& tsdf, const DepthNoise& noise,
                   const PinholeCamera& camera);
  /// `points` keeps its memory from image to image. Readings out of range, at depth edges, at grazing angles
  /// and beside pixels without a reading are left out.
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
