#pragma once
#include <cstdint>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"
#include "hm/tsdf/grid/volume.hpp"
#include "hm/tsdf/tsdf_params.hpp"
#include "hm/tsdf/update/discrete_update_filter.hpp"

namespace hm {

/// Side of the pixel tiles used for finding volumes and for conservative carving.
inline constexpr int kTileSide = 8;

/// Truncation band as a single-precision polynomial, evaluated identically by both kernels (4.2.2).
struct TruncationModel {
  float quadratic = 0, linear = 0, constant = 0;  ///< sigmas * noise polynomial, metres
  float min_m = 0, max_m = 0;

  TruncationModel() = default;
  TruncationModel(const TsdfParams& params, const DepthNoise& noise);
  [[nodiscard]] float at(float depth_m) const {
    float tau = (quadratic * depth_m + linear) * depth_m + constant;
    tau = tau > min_m ? tau : min_m;
    return tau < max_m ? tau : max_m;
  }
};

/// Weight of an observation, in 1/kWeightOne; for `numerator` see ProjectionScan.
inline float observation_weight(float numerator, float tau_m) { return round_to_even(numerator / tau_m); }

/// Depth image prepared for integration: in metres, with range limits and tile extremes.
struct PreparedDepth {
  /// Depth in metres; 0 for no reading or below the near limit; kFarM for readings beyond the far limit,
  /// which only carve. Negative at depth edges (see depth_edges.hpp), where observations have less weight.
  static constexpr float kFarM = 1e4f;
  Image<float> depth_m;
  int tiles_x = 0, tiles_y = 0;
  /// Extremes of each tile's readings within range; where it has none, min = kFarM and max = 0, or kOpen if
  /// it has readings beyond far.
  static constexpr float kOpen = -1.0f;
  std::vector<float> tile_min_m, tile_max_m;
  std::size_t pixels_in_range = 0;
  std::size_t pixels_valid = 0;  ///< any reading at all
};

/// Constants of a scan. Homogeneous pixel coordinates h = K (R p + t) are affine in the voxel's position: h =
/// h(voxel 0 of the volume) + z * step_z + lane(x, y).
struct ProjectionScan {
  const float* depth_m = nullptr;
  const float* tile_min_m = nullptr;
  const std::uint8_t* rgb = nullptr;  ///< nullptr: no colour; at least 1 readable byte after the last pixel
  int width = 0, height = 0, tiles_x = 0;
  float max_u = 0, max_v = 0;          ///< width - 0.5, height - 0.5
  alignas(64) float lane[3][64] = {};  ///< for (x, y) at 8 y + x
  float step_z[3] = {};
  TruncationModel truncation;
  float carving_margin_m = 0;
  std::int32_t stale_below = 1;  ///< known voxels with an sdf below this (units) are carved
  float carving_factor = 0;      ///< 0: no carving
  float distance_limit_m = 0;    ///< see TsdfParams
  float sdf_units_per_m = 0;
  float weight_numerator = 0;       ///< observation weight times truncation, 1/kWeightOne times metres
  float edge_weight_numerator = 0;  ///< the same at depth edges
  float weight_cap = 0;             ///< in 1/kWeightOne
  float color_band_m = 0;
  std::uint32_t color_cap = 0;
  // For placing volumes, in double precision:
  Mat3 H = Mat3::Identity();  ///< K R, world to homogeneous pixels
  Vec3 h0 = Vec3::Zero();     ///< K t
  double voxel_size_m = 0;

  /// Homogeneous pixel coordinates h of the volume's first voxel centre.
  [[nodiscard]] Eigen::Vector3f origin_of(VolumeKey key) const;
};

/// Sets everything except the image pointers. T_camera_world is the inverse of the camera's pose.
ProjectionScan make_projection_scan(const PinholeCamera& camera, const SE3& T_camera_world,
                                    const TsdfParams& params, const DepthNoise& noise);

/// Effect of the kernel on one volume.
struct VolumeUpdate {
  std::uint32_t updated = 0;  ///< updated voxels in the hit region
  std::uint32_t freed = 0;    ///< voxels in front of it, updated as free (at the distance limit)
  std::uint32_t carved = 0;   ///< voxels changed by carving, or from solid to free
  std::uint32_t colored = 0;
  std::uint8_t border_layers = 0;  ///< see ChangedVolume
  bool interior_hit = false;       ///< an updated voxel has distance <= 0
};

/// Masks of the 32 parts of a volume (16 voxels stored together: bit i for voxels 16 i ...) by their possible
/// position; by default anywhere. They only save work and never change the result.
struct PartMasks {
  std::uint32_t in_band = ~std::uint32_t{0};   ///< may hold voxels of the hit region
  std::uint32_t in_front = ~std::uint32_t{0};  ///< may hold voxels in front of it, which rays carve
};

/// Task of one volume of a scan; `colors` is nullptr without colour.
///
/// If one of its voxels lies in the hit region, all voxels up to the region's end are updated, those in front
/// of it as free (at the distance limit), so that rays passing there correct the fringes of mixed pixels
/// beside a surface. Otherwise the volume can be carved.
struct ProjectionTask {
  VolumeKey key;
  TsdfVoxel* voxels = nullptr;
  ColorVoxel* colors = nullptr;
  PartMasks parts;
  bool may_carve = true;  ///< false: it holds no voxel on or behind a surface
};

/// Voxel projection (4.3.2) of one volume: scalar reference implementation.
VolumeUpdate project_volume_scalar(const ProjectionScan& scan, const ProjectionTask& task);
/// The same with the widest vectors of this CPU, bit-identical.
VolumeUpdate project_volume_simd(const ProjectionScan& scan, const ProjectionTask& task);
/// Name of the instruction set used by project_volume_simd on this CPU.
const char* simd_target_name();

}  // namespace hm
