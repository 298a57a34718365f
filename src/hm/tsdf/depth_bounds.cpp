#include "hm/tsdf/depth_bounds.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

/// Single precision and rounding to pixels: a tenth of a millimetre, half a pixel.
constexpr float kSlackM = 1e-4f;
constexpr float kSlackPx = 0.51f;

/// The extremes of (centre +- half) / z for z in [near, far], near > 0.
std::pair<float, float> quotient_range(float centre, float half, float near_m, float far_m) {
  const float low = centre - half, high = centre + half;
  return {low / (low < 0 ? near_m : far_m), high / (high > 0 ? near_m : far_m)};
}

}  // namespace

DepthBounds::DepthBounds(const PreparedDepth& depth, const PinholeCamera& camera, const SE3& T_camera_world,
                         const TsdfParams& params, const TruncationModel& truncation)
    : depth_(depth), truncation_(truncation), fx_(static_cast<float>(camera.fx)),
      fy_(static_cast<float>(camera.fy)), cx_(static_cast<float>(camera.cx)), cy_(static_cast<float>(camera.cy)) {
  const double size = params.voxel_size_m * kVolumeSide;
  margin_m_ = static_cast<float>(params.carving_margin_voxel * params.voxel_size_m);
  rotation_ = (T_camera_world.rotation() * size).cast<float>();
  translation_ = (T_camera_world * Vec3(Vec3::Constant(0.5 * size))).cast<float>();
  const double half = 0.5 * (kVolumeSide - 1) * params.voxel_size_m;
  half_ = (T_camera_world.rotation().cwiseAbs() * Vec3::Constant(half)).cast<float>();
}

DepthBounds::Footprint DepthBounds::footprint_of(VolumeKey key) const {
  const Eigen::Vector3f centre = rotation_ * Eigen::Vector3i(key.x, key.y, key.z).cast<float>() + translation_;
  Footprint print{.near_m = centre.z() - half_.z() - kSlackM, .far_m = centre.z() + half_.z() + kSlackM};
  if (print.near_m < 0.02f) {  // at or behind the camera: no bound on where it falls
    if (print.far_m > 0) print.x1 = depth_.tiles_x - 1, print.y1 = depth_.tiles_y - 1;
    return print;
  }
  const auto tile = [](float pixel, int tiles) {
    return static_cast<int>(std::clamp(std::floor(pixel / kTileSide), -1.0f, static_cast<float>(tiles)));
  };
  const auto [u0, u1] = quotient_range(centre.x(), half_.x() + kSlackM, print.near_m, print.far_m);
  auto [v0, v1] = quotient_range(centre.y(), half_.y() + kSlackM, print.near_m, print.far_m);
  if (fy_ < 0) std::swap(v0, v1);
  print.x0 = std::max(0, tile(fx_ * u0 + cx_ - kSlackPx, depth_.tiles_x));
  print.x1 = std::min(depth_.tiles_x - 1, tile(fx_ * u1 + cx_ + kSlackPx, depth_.tiles_x));
  print.y0 = std::max(0, tile(fy_ * v0 + cy_ - kSlackPx, depth_.tiles_y));
  print.y1 = std::min(depth_.tiles_y - 1, tile(fy_ * v1 + cy_ + kSlackPx, depth_.tiles_y));
  return print;
}

DepthBounds::Band DepthBounds::band_of(VolumeKey key) const {
  const Footprint print = footprint_of(key);
  float low = PreparedDepth::kFarM, high = 0, lowest_high = PreparedDepth::kFarM;
  for (int y = print.y0; y <= print.y1; ++y) {
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(y) * depth_.tiles_x;
    for (int x = print.x0; x <= print.x1; ++x) {
      const float tile_max = depth_.tile_max_m[static_cast<std::size_t>(row + x)];
      low = std::min(low, depth_.tile_min_m[static_cast<std::size_t>(row + x)]);
      high = std::max(high, tile_max);
      lowest_high = std::min(lowest_high, tile_max);
    }
  }
  if (high <= 0) return {};
  const float tau = std::max(truncation_.at(low), truncation_.at(high)) + kSlackM;
  const Band band{low - tau, high + tau, lowest_high < 0};
  return print.near_m > band.far_m || print.far_m < band.near_m ? Band{} : band;
}

bool DepthBounds::may_be_seen_through(VolumeKey key) const {
  const Footprint print = footprint_of(key);
  for (int y = print.y0; y <= print.y1; ++y)
    for (int x = print.x0; x <= print.x1; ++x) {
      const auto i = static_cast<std::size_t>(y * depth_.tiles_x + x);
      const float tile_max = depth_.tile_max_m[i];
      if ((tile_max == PreparedDepth::kOpen ? PreparedDepth::kFarM : tile_max) > print.near_m + margin_m_) return true;
    }
  return false;
}

}  // namespace hm
