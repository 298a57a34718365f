#include "hm/tsdf/candidate_volumes.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "hm/core/check.hpp"

namespace hm {

void CandidateFinder::find(const PreparedDepth& depth, const PinholeCamera& camera, const SE3& T_world_camera,
                           const TsdfParams& params, const TruncationModel& truncation,
                           std::vector<VolumeKey>& keys) {
  keys.clear();
  if (depth.pixels_in_range == 0) return;
  truncation_ = truncation;
  const double volume_size = params.voxel_size_m * kVolumeSide;
  volume_size_m_ = static_cast<float>(volume_size);
  const Vec3 at = T_world_camera.translation() / volume_size;
  base_ = {static_cast<int>(std::floor(at.x())), static_cast<int>(std::floor(at.y())),
           static_cast<int>(std::floor(at.z()))};
  origin_ = (at - Vec3(base_.x, base_.y, base_.z)).cast<float>();
  corners_x_ = depth.tiles_x + 1;
  rays_.clear();
  for (int y = 0; y <= depth.tiles_y; ++y)
    for (int x = 0; x <= depth.tiles_x; ++x) {
      // Pixel cells reach half a pixel beyond centres, which is where rounding to pixels cuts.
      const Vec2 corner(std::min(x * kTileSide, camera.width) - 0.5, std::min(y * kTileSide, camera.height) - 0.5);
      rays_.push_back((T_world_camera.rotation() * camera.unproject(corner, 1.0) / volume_size).cast<float>());
    }
  place_bitmap(depth, truncation.max_m);
  for (int y = 0; y < depth.tiles_y; ++y)
    for (int x = 0; x < depth.tiles_x; ++x) mark_tile(depth, x, y);
  collect(keys);
}

/// Lays the bitmap over the box of the part of the frustum that has readings.
void CandidateFinder::place_bitmap(const PreparedDepth& depth, float widest_m) {
  const float near_m = *std::min_element(depth.tile_min_m.begin(), depth.tile_min_m.end()) - widest_m;
  const float far_m = *std::max_element(depth.tile_max_m.begin(), depth.tile_max_m.end()) + widest_m;
  Eigen::AlignedBox3f box;
  const std::size_t last_row = rays_.size() - static_cast<std::size_t>(corners_x_);
  for (const std::size_t corner :
       {std::size_t{0}, static_cast<std::size_t>(corners_x_ - 1), last_row, rays_.size() - 1})
    for (const float z : {std::max(near_m, 0.0f), far_m}) box.extend(origin_ + rays_[corner] * z);
  const Eigen::Vector3i low = box.min().array().floor().cast<int>() - 1;
  const Eigen::Vector3i size = box.max().array().floor().cast<int>() + 2 - low.array();
  base_ = {base_.x + low.x(), base_.y + low.y(), base_.z + low.z()};
  origin_ -= low.cast<float>();
  size_x_ = size.x();
  size_y_ = size.y();
  size_z_ = size.z();
  words_x_ = (size_x_ + 63) / 64;
  const std::size_t words =
      static_cast<std::size_t>(words_x_) * static_cast<std::size_t>(size_y_) * static_cast<std::size_t>(size_z_);
  HM_CHECK(words < (std::size_t{1} << 27u), "{} x {} x {} volumes in one frustum", size_x_, size_y_, size_z_);
  if (bitmap_.size() < words) bitmap_.resize(words, 0);
}

void CandidateFinder::mark_tile(const PreparedDepth& depth, int tile_x, int tile_y) {
  const auto tile = static_cast<std::size_t>(tile_y * depth.tiles_x + tile_x);
  const float low = depth.tile_min_m[tile], high = depth.tile_max_m[tile];
  if (high <= 0.0f) return;
  if (high - low > 0.5f * volume_size_m_) mark_gapped_tile(depth, tile_x, tile_y);
  else mark_segment(tile_x, tile_y, {low, high});
}

/// Sorts the tile's readings into 64 bins of depth and marks each run of filled bins.
void CandidateFinder::mark_gapped_tile(const PreparedDepth& depth, int tile_x, int tile_y) {
  const auto tile = static_cast<std::size_t>(tile_y * depth.tiles_x + tile_x);
  const float low = depth.tile_min_m[tile], high = depth.tile_max_m[tile];
  const float bins_per_m = 63.999f / (high - low);
  std::uint64_t filled = 0;
  const int end_y = std::min((tile_y + 1) * kTileSide, depth.depth_m.height());
  const int end_x = std::min((tile_x + 1) * kTileSide, depth.depth_m.width());
  for (int y = tile_y * kTileSide; y < end_y; ++y)
    for (int x = tile_x * kTileSide; x < end_x; ++x) {
      const float z = depth.depth_m(x, y);
      if (z > 0.0f && z < PreparedDepth::kFarM)
        filled |= std::uint64_t{1} << static_cast<unsigned>((z - low) * bins_per_m);
    }
  // One bin more at each end keeps readings on a bin's edge inside, whatever the rounding.
  const float bin_m = 1.0f / bins_per_m;
  while (filled != 0) {
    const int begin = std::countr_zero(filled);
    const int length = std::countr_one(filled >> begin);
    mark_segment(tile_x, tile_y,
                 {std::max(low, low + static_cast<float>(begin - 1) * bin_m),
                  std::min(high, low + static_cast<float>(begin + length + 1) * bin_m)});
    if (begin + length >= 64) break;
    filled &= ~std::uint64_t{0} << (begin + length);
  }
}

void CandidateFinder::mark_segment(int tile_x, int tile_y, Segment segment) {
  // A reading's band reaches as far as the widest truncation among the segment's readings.
  const float tau = std::max(truncation_.at(segment.near_m), truncation_.at(segment.far_m));
  const float near_m = std::max(segment.near_m - tau, 0.0f), far_m = segment.far_m + tau;
  const auto corner = static_cast<std::size_t>(tile_y * corners_x_ + tile_x);
  const std::array<const Eigen::Vector3f*, 4> rays{&rays_[corner], &rays_[corner + 1],
                                                   &rays_[corner + static_cast<std::size_t>(corners_x_)],
                                                   &rays_[corner + static_cast<std::size_t>(corners_x_) + 1]};
  const Eigen::Vector3f ray_low = rays[0]->cwiseMin(*rays[1]).cwiseMin(rays[2]->cwiseMin(*rays[3]));
  const Eigen::Vector3f ray_high = rays[0]->cwiseMax(*rays[1]).cwiseMax(rays[2]->cwiseMax(*rays[3]));
  // Short pieces keep the boxes around slanted rays tight.
  const int pieces = 1 + static_cast<int>((far_m - near_m) / (0.5f * volume_size_m_));
  const float step = (far_m - near_m) / static_cast<float>(pieces);
  for (int piece = 0; piece < pieces; ++piece) {
    const float z0 = near_m + static_cast<float>(piece) * step, z1 = z0 + step;
    mark_box(origin_ + (ray_low * z0).cwiseMin(ray_low * z1), origin_ + (ray_high * z0).cwiseMax(ray_high * z1));
  }
}

void CandidateFinder::mark_box(const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  // Coordinates are at least 1 here (the bitmap has a margin), so truncation is floor.
  const auto clip = [](float v, int size) { return std::clamp(static_cast<int>(v), 0, size - 1); };
  constexpr float kSlack = 1e-4f;  // single precision
  const int x0 = clip(low.x() - kSlack, size_x_), x1 = clip(high.x() + kSlack, size_x_);
  const int y0 = clip(low.y() - kSlack, size_y_), y1 = clip(high.y() + kSlack, size_y_);
  const int z0 = clip(low.z() - kSlack, size_z_), z1 = clip(high.z() + kSlack, size_z_);
  for (int z = z0; z <= z1; ++z)
    for (int y = y0; y <= y1; ++y) {
      std::uint64_t* row = &bitmap_[static_cast<std::size_t>((z * size_y_ + y) * words_x_)];
      for (int x = x0; x <= x1; ++x) row[x >> 6] |= std::uint64_t{1} << (x & 63);
    }
}

void CandidateFinder::collect(std::vector<VolumeKey>& keys) {
  std::size_t word = 0;
  for (int z = 0; z < size_z_; ++z)
    for (int y = 0; y < size_y_; ++y)
      for (int x = 0; x < words_x_; ++x, ++word) {
        for (std::uint64_t bits = bitmap_[word]; bits != 0; bits &= bits - 1)
          keys.push_back({base_.x + 64 * x + std::countr_zero(bits), base_.y + y, base_.z + z});
        bitmap_[word] = 0;
      }
}

}  // namespace hm
