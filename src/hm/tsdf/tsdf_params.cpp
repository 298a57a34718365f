#include "hm/tsdf/tsdf_params.hpp"

#include <algorithm>

namespace hm {

double TsdfParams::truncation_m(const DepthNoise& noise, double depth_m) const {
  if (!dynamic_truncation) return fixed_truncation_voxel * voxel_size_m;
  return std::clamp(truncation_sigmas_ratio * noise.sigma_m(depth_m), min_truncation_voxel * voxel_size_m,
                    max_truncation_voxel * voxel_size_m);
}

double TsdfParams::max_truncation_m() const {
  return (dynamic_truncation ? max_truncation_voxel : fixed_truncation_voxel) * voxel_size_m;
}

double TsdfParams::distance_limit_m() const {
  const double narrowest_voxel = dynamic_truncation ? min_truncation_voxel : fixed_truncation_voxel;
  return std::min(kDistanceLimit_voxel, narrowest_voxel) * voxel_size_m;
}

Result<void> check_params(const TsdfParams& params) {
  if (params.near_m >= params.far_m)
    return fail(ErrorCode::kInvalidValue, "parameters", "tsdf.near_m = {} is not below tsdf.far_m = {}",
                params.near_m, params.far_m);
  if (params.min_truncation_voxel > params.max_truncation_voxel)
    return fail(ErrorCode::kInvalidValue, "parameters",
                "tsdf.min_truncation_voxel = {} is above the widest truncation, {} voxels",
                params.min_truncation_voxel, params.max_truncation_voxel);
  return {};
}

}  // namespace hm
