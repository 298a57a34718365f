#include "hm/tsdf/projection/candidate_volumes.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

namespace hm {
namespace {

/// Sets bits that other threads may set too; usually they are already set. The result does not depend on the
/// order of threads.
void set_bits(std::uint64_t& word, std::uint64_t bits) {
  const std::atomic_ref<std::uint64_t> shared(word);
  if ((shared.load(std::memory_order_relaxed) & bits) != bits)
    shared.fetch_or(bits, std::memory_order_relaxed);
}

}  // namespace

bool CandidateFinder::find(const BandQuery& query, const ParallelLoop& loop, std::vector<VolumeKey>& keys) {
  const PreparedDepth& depth = query.depth;
  keys.clear();
  bitmap_.clear();
  size_x_ = size_y_ = size_z_ = 0;
  volumes_spanned_ = bitmap_bytes_ = 0;
  if (depth.pixels_in_range == 0) return true;
  truncation_ = query.truncation;
  const double volume_size = query.voxel_size_m * kVolumeSide;
  volume_size_m_ = static_cast<float>(volume_size);
  const Vec3 at = query.T_world_camera.translation() / volume_size;
  base_ = {static_cast<int>(std::floor(at.x())), static_cast<int>(std::floor(at.y())),
           static_cast<int>(std::floor(at.z()))};
  origin_ << (at - Vec3(base_.x, base_.y, base_.z)).cast<float>().array(), 0.0f;
  corners_x_ = depth.tiles_x + 1;
  place_rays(depth, query.camera, query.T_world_camera.rotation() / volume_size);
  if (!place_bitmap(depth, truncation_.max_m)) return false;
  loop.for_ranges(static_cast<std::size_t>((depth.tiles_y + 1) / 2), 2,
                  [&](std::size_t begin, std::size_t end) {
                    for (auto y = 2 * static_cast<int>(begin);
                         y < std::min(2 * static_cast<int>(end), depth.tiles_y); y += 2)
                      for (int x = 0; x < depth.tiles_x; x += 2) mark_quad(depth, x, y);
                  });
  collect(keys);
  return true;
}

/// Rays through the corners of tiles: without distortion they are a sum of a column's and a row's share.
void CandidateFinder::place_rays(const PreparedDepth& depth, const PinholeCamera& camera,
                                 const Mat3& R_world_camera_per_m) {
  const auto share = [&](int axis, double per_px) {
    Eigen::Array4f ray;
    ray << (R_world_camera_per_m.col(axis) * per_px).cast<float>().array(), 0.0f;
    return ray;
  };
  // Pixel cells extend half a pixel beyond centres, the boundary of rounding to pixels.
  columns_.clear();
  for (int x = 0; x <= depth.tiles_x; ++x)
    columns_.push_back(share(0, (std::min(x * kTileSide, camera.width) - 0.5 - camera.cx) / camera.fx));
  rays_.clear();
  for (int y = 0; y <= depth.tiles_y; ++y) {
    const Eigen::Array4f row =
        share(1, (std::min(y * kTileSide, camera.height) - 0.5 - camera.cy) / camera.fy) + share(2, 1.0);
    for (const Eigen::Array4f& column : columns_) rays_.push_back(row + column);
  }
}

/// Places the bitmap over the bounding box of the part of the frustum with readings.
bool CandidateFinder::place_bitmap(const PreparedDepth& depth, float widest_m) {
  const float near_m = *std::min_element(depth.tile_min_m.begin(), depth.tile_min_m.end()) - widest_m;
  const float far_m = *std::max_element(depth.tile_max_m.begin(), depth.tile_max_m.end()) + widest_m;
  Eigen::AlignedBox3f box;
  const std::size_t last_row = rays_.size() - static_cast<std::size_t>(corners_x_);
  for (const std::size_t corner :
       {std::size_t{0}, static_cast<std::size_t>(corners_x_ - 1), last_row, rays_.size() - 1})
    for (const float z : {std::max(near_m, 0.0f), far_m})
      box.extend((origin_ + rays_[corner] * z).head<3>().matrix());
  const Vec3 span = (box.max() - box.min()).cast<double>().array() + 3;
  volumes_spanned_ = span.prod();
  bitmap_bytes_ = 8 * (span.x() / 64 + 1) * span.y() * span.z();
  if (!(bitmap_bytes_ <= kMostBitmapBytes)) return false;
  const Eigen::Vector3i low = box.min().array().floor().cast<int>() - 1;
  const Eigen::Vector3i size = box.max().array().floor().cast<int>() + 2 - low.array();
  base_ = {base_.x + low.x(), base_.y + low.y(), base_.z + low.z()};
  origin_.head<3>() -= low.cast<float>().array();
  size_x_ = size.x();
  size_y_ = size.y();
  size_z_ = size.z();
  words_x_ = (size_x_ + 63) / 64;
  const std::size_t words = static_cast<std::size_t>(words_x_) * static_cast<std::size_t>(size_y_) *
                            static_cast<std::size_t>(size_z_);
  bitmap_.assign(words, 0);
  return true;
}

/// Marks two by two tiles at once if they are small and flat relative to a volume, else one by one.
void CandidateFinder::mark_quad(const PreparedDepth& depth, int tile_x, int tile_y) {
  const int width = std::min(2, depth.tiles_x - tile_x), height = std::min(2, depth.tiles_y - tile_y);
  float low = PreparedDepth::kFarM, high = 0;
  for (int y = tile_y; y < tile_y + height; ++y)
    for (int x = tile_x; x < tile_x + width; ++x) {
      const auto tile = static_cast<std::size_t>(y * depth.tiles_x + x);
      low = std::min(low, depth.tile_min_m[tile]);
      high = std::max(high, depth.tile_max_m[tile]);
    }
  if (high <= 0.0f) return;
  const auto corner = static_cast<std::size_t>(tile_y * corners_x_ + tile_x);
  const float side =
      ((rays_[corner + static_cast<std::size_t>(width)] - rays_[corner]) * high).matrix().norm();
  if (high - low < volume_size_m_ && side < 0.5f) {
    mark_segment({tile_x, tile_y, width, height}, {low, high});
    return;
  }
  for (int y = tile_y; y < tile_y + height; ++y)
    for (int x = tile_x; x < tile_x + width; ++x) mark_tile(depth, x, y);
}

void CandidateFinder::mark_tile(const PreparedDepth& depth, int tile_x, int tile_y) {
  const auto tile = static_cast<std::size_t>(tile_y * depth.tiles_x + tile_x);
  const float low = depth.tile_min_m[tile], high = depth.tile_max_m[tile];
  if (high <= 0.0f) return;
  if (high - low > volume_size_m_)
    mark_gapped_tile(depth, tile_x, tile_y);
  else
    mark_segment({tile_x, tile_y, 1, 1}, {low, high});
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
      const float z = std::abs(depth.depth_m(x, y));
      if (z > 0.0f && z < PreparedDepth::kFarM)
        filled |= std::uint64_t{1} << static_cast<unsigned>((z - low) * bins_per_m);
    }
  // One bin more at each end keeps readings on a bin's edge inside, whatever the rounding.
  const float bin_m = 1.0f / bins_per_m;
  while (filled != 0) {
    const int begin = std::countr_zero(filled);
    const int length = std::countr_one(filled >> begin);
    mark_segment({tile_x, tile_y, 1, 1},
                 {std::max(low, low + static_cast<float>(begin - 1) * bin_m),
                  std::min(high, low + static_cast<float>(begin + length + 1) * bin_m)});
    if (begin + length >= 64) break;
    filled &= ~std::uint64_t{0} << (begin + length);
  }
}

void CandidateFinder::mark_segment(const Tiles& tiles, Segment segment) {
  // The band uses the widest truncation among the segment's readings.
  const float tau = std::max(truncation_.at(segment.near_m), truncation_.at(segment.far_m));
  const float near_m = std::max(segment.near_m - tau, 0.0f), far_m = segment.far_m + tau;
  const Eigen::Array4f* upper = rays_.data() + tiles.y * corners_x_ + tiles.x;
  const Eigen::Array4f* lower = upper + tiles.height * corners_x_;
  const int right = tiles.width;
  const Eigen::Array4f ray_low = upper[0].min(upper[right]).min(lower[0].min(lower[right]));
  const Eigen::Array4f ray_high = upper[0].max(upper[right]).max(lower[0].max(lower[right]));
  // Short segments keep the boxes around oblique rays tight.
  const int pieces = 1 + static_cast<int>((far_m - near_m) / (0.8f * volume_size_m_));
  const float step = (far_m - near_m) / static_cast<float>(pieces);
  for (int piece = 0; piece < pieces; ++piece) {
    const float z0 = near_m + static_cast<float>(piece) * step, z1 = z0 + step;
    mark_box(origin_ + (ray_low * z0).min(ray_low * z1), origin_ + (ray_high * z0).max(ray_high * z1));
  }
}

void CandidateFinder::mark_box(const Eigen::Array4f& low, const Eigen::Array4f& high) {
  // Coordinates are at least 1 here (the bitmap has a margin), so conversion is floor.
  constexpr float kSlack = 1e-4f;  // single precision
  const Eigen::Array4i from = (low - kSlack).cast<int>(), to = (high + kSlack).cast<int>();
  const int x0 = std::max(from[0], 0), x1 = std::min(to[0], size_x_ - 1);
  const int y0 = std::max(from[1], 0), y1 = std::min(to[1], size_y_ - 1);
  const int z0 = std::max(from[2], 0), z1 = std::min(to[2], size_z_ - 1);
  for (int word = x0 >> 6; word <= x1 >> 6; ++word) {
    const int first = std::max(x0 - 64 * word, 0), last = std::min(x1 - 64 * word, 63);
    const std::uint64_t bits = (~std::uint64_t{0} >> (63 - last)) & (~std::uint64_t{0} << first);
    for (int z = z0; z <= z1; ++z)
      for (int y = y0; y <= y1; ++y)
        set_bits(bitmap_[static_cast<std::size_t>((z * size_y_ + y) * words_x_ + word)], bits);
  }
}

void CandidateFinder::collect(std::vector<VolumeKey>& keys) {
  std::size_t word = 0;
  for (int z = 0; z < size_z_; ++z)
    for (int y = 0; y < size_y_; ++y)
      for (int x = 0; x < words_x_; ++x, ++word) {
        for (std::uint64_t bits = bitmap_[word]; bits != 0; bits &= bits - 1)
          keys.push_back({base_.x + 64 * x + std::countr_zero(bits), base_.y + y, base_.z + z});
      }
}

bool CandidateFinder::found(VolumeKey key) const {
  const int x = key.x - base_.x, y = key.y - base_.y, z = key.z - base_.z;
  if (x < 0 || x >= size_x_ || y < 0 || y >= size_y_ || z < 0 || z >= size_z_) return false;
  return bitmap_[static_cast<std::size_t>((z * size_y_ + y) * words_x_ + x / 64)] >> (x % 64) & 1u;
}

}  // namespace hm
