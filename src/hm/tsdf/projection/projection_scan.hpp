#pragma once
#include <cstdint>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"
#include "hm/tsdf/grid/volume.hpp"
#include "hm/tsdf/projection/tsdf_params.hpp"
#include "hm/tsdf/projection/update_filters.hpp"

namespace hm {

/// Pixels are grouped in tiles of this side, for finding volumes and for careful carving.
inline constexpr int kTileSide = 8;

/// The truncation band as single-precision polynomial, as both kernels evaluate it (4.2.2).
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

/// The weight of an observation, in 1/kWeightOne; `numerator` of its kind (see ProjectionScan).
inline float observation_weight(float numerator, float tau_m) { return round_to_even(numerator / tau_m); }

/// A depth image made ready for integration: metres, range limits applied, tile extremes.
struct PreparedDepth {
  /// Metres; 0 for no reading or nearer than near; kFarM for readings beyond far, which only carve.
  /// Negative at depth edges (see depth_edges.hpp), where an observation weighs less.
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

/// What is the same for all voxels of a scan. Homogeneous pixel coordinates h = K (R p + t) are affine in
/// the voxel's place: h = h(voxel 0 of the volume) + z * step_z + lane(x, y).
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
  std::int32_t stale_below = 1;  ///< known voxels nearer to a surface than this (sdf units) are to be carved
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

  /// h of the volume's first voxel centre.
  [[nodiscard]] Eigen::Vector3f origin_of(VolumeKey key) const;
};

/// Sets everything up but the picture pointers. T_camera_world is the inverse of the camera's pose.
ProjectionScan make_projection_scan(const PinholeCamera& camera, const SE3& T_camera_world,
                                    const TsdfParams& params, const DepthNoise& noise);

/// What the kernel did to one volume.
struct VolumeUpdate {
  std::uint32_t updated = 0;  ///< voxels of the hit region, which took an observation
  std::uint32_t freed = 0;    ///< voxels in front of it, which took "free: at least the distance limit away"
  std::uint32_t carved = 0;   ///< voxels that carving changed, or that "free" turned from solid to free
  std::uint32_t colored = 0;
  std::uint8_t border_layers = 0;  ///< see ChangedVolume
  bool interior_hit = false;       ///< an observation left a voxel at distance <= 0
};

/// The 32 parts of a volume (16 voxels that are stored together: bit i for voxels 16 i ...) by where they may
/// lie; by default anywhere. They save work and never change the result.
struct PartMasks {
  std::uint32_t in_band = ~std::uint32_t{0};   ///< may hold voxels of the hit region
  std::uint32_t in_front = ~std::uint32_t{0};  ///< may hold voxels in front of it, which rays carve
};

/// One volume of a scan: `colors` is nullptr where colour is not wanted.
///
/// If one of its voxels lies in the hit region, all voxels down to the region's end are observed, those in
/// front of it as free: at least the distance limit away from the surface. So fringes of mixed pixels,
/// which hang in the air beside a surface, are outvoted by the rays that pass there. Else it can be carved.
struct ProjectionTask {
  VolumeKey key;
  TsdfVoxel* voxels = nullptr;
  ColorVoxel* colors = nullptr;
  PartMasks parts;
  bool may_carve = true;  ///< false: it holds no voxel on or behind a surface
};

/// Voxel projection (4.3.2) of one volume: the plain reference.
VolumeUpdate project_volume_scalar(const ProjectionScan& scan, const ProjectionTask& task);
/// Voxel projection of one volume with the widest vectors of this CPU: the bits of project_volume_scalar().
VolumeUpdate project_volume_simd(const ProjectionScan& scan, const ProjectionTask& task);
/// The name of the instruction set that project_volume_simd uses here.
const char* simd_target_name();

}  // namespace hm
