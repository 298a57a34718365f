// Bounds for the parts of a volume: the 32 parts at once, with vectors (Highway).
#include "hm/tsdf/depth_bounds.hpp"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hm/tsdf/depth_bounds.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

PartMasks PartsOf(const DepthBounds& bounds, const DepthBounds::Level& level, const Eigen::Vector3f& origin) {
  const hn::CappedTag<float, 16> d;
  const hn::RebindToSigned<decltype(d)> di;
  constexpr float kSlackM = 1e-4f;
  const auto half_z = hn::Set(d, bounds.part_half[2] + kSlackM);
  const auto lowest = hn::Set(di, 0);
  const auto last_column = hn::Set(di, bounds.stride - 1), last_row = hn::Set(di, bounds.rows - 1);
  const auto pad = hn::Set(di, DepthBounds::kPad), stride = hn::Set(di, bounds.stride);
  const auto far_out = hn::Set(d, 1e5f);
  PartMasks masks{0, 0};
  for (std::size_t i = 0; i < 32; i += hn::Lanes(d)) {
    const auto z = hn::Add(hn::Set(d, origin[2]), hn::LoadU(d, bounds.part_centre[2].data() + i));
    const auto inverse = hn::Div(hn::Set(d, 1.0f), z);
    const auto clamped = [&](int axis) HWY_ATTR {
      const auto h = hn::Add(hn::Set(d, origin[axis]),
                             hn::LoadU(d, bounds.part_centre[static_cast<std::size_t>(axis)].data() + i));
      return hn::Max(hn::Neg(far_out), hn::Min(hn::Mul(h, inverse), far_out));
    };
    const auto tile = [&](int axis, auto last) HWY_ATTR {
      const auto pixel = hn::NearestInt(clamped(axis));
      return hn::Min(hn::Max(hn::Add(hn::ShiftRight<3>(pixel), pad), lowest), last);
    };
    const auto at = hn::Add(hn::Mul(tile(1, last_row), stride), tile(0, last_column));
    const auto near_m = hn::GatherIndex(d, level.near_m.data(), at);
    const auto far_m = hn::GatherIndex(d, level.far_m.data(), at);
    const auto nearest = hn::Sub(z, half_z), farthest = hn::Add(z, half_z);
    const auto reaches = hn::Ge(farthest, near_m);
    const auto in_band = hn::And(reaches, hn::Le(nearest, far_m));
    const auto in_front = hn::Lt(nearest, near_m);
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, in_band, bits);
    masks.in_band |= (static_cast<std::uint32_t>(bits[0]) | static_cast<std::uint32_t>(bits[1]) << 8u) << i;
    hn::StoreMaskBits(d, in_front, bits);
    masks.in_front |= (static_cast<std::uint32_t>(bits[0]) | static_cast<std::uint32_t>(bits[1]) << 8u) << i;
  }
  return masks;
}

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hm {
HWY_EXPORT(PartsOf);

namespace {

constexpr float kSeesNothingNear = 1e9f, kSeesNothingFar = -1e9f;
constexpr std::array kRadiiTiles{1, 2, 3, 4, 6, 8};

/// How far from its centre a part may fall in the picture, in pixels, when its nearest point is at `z` and its
/// centre falls `off_axis_px` from the principal point.
float reach_px(const Eigen::Vector3f& half, const Eigen::Vector2f& off_axis_px, float z) {
  const Eigen::Array2f across = (half.head<2>().array() + off_axis_px.array() * half.z()) / z;
  return across.maxCoeff() + 1.01f;  // rounding to pixels, twice
}

}  // namespace

void DepthBounds::build(const PreparedDepth& depth, const ProjectionScan& scan, const PinholeCamera& camera) {
  scan_ = scan;
  const Mat3 step = scan.H * scan.voxel_size_m;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto row = step.row(static_cast<Eigen::Index>(axis));
    for (std::size_t part = 0; part < 32; ++part)
      part_centre[axis][part] = static_cast<float>(row.dot(
          Vec3(3.5, 2.0 * static_cast<double>(part % 4) + 0.5, static_cast<double>(part / 4)).transpose()));
  }
  principal_px_ = Eigen::Vector2f(static_cast<float>(camera.cx), static_cast<float>(camera.cy));
  Mat3 reach = step;  // without the principal point: how far apart points fall
  reach.row(0) -= camera.cx * step.row(2);
  reach.row(1) -= camera.cy * step.row(2);
  part_half = (reach.cwiseAbs() * Vec3(3.5, 0.5, 0.0)).cast<float>();
  volume_half_ = (reach.cwiseAbs() * Vec3::Constant(3.5)).cast<float>();
  volume_centre_ = (step * Vec3::Constant(3.5)).cast<float>();
  stride = depth.tiles_x + 2 * kPad;
  rows = depth.tiles_y + 2 * kPad;
  levels_.resize(kRadiiTiles.size());
  fill_first_level(depth, scan.truncation);
  // Levels grow out of each other, as far as the nearest reading's footprint may need.
  const float near_m = *std::min_element(depth.tile_min_m.begin(), depth.tile_min_m.end());
  const float nearest = std::max(0.05f, std::min(near_m, PreparedDepth::kFarM) - scan.truncation.max_m);
  const Eigen::Vector2f corner(static_cast<float>(scan.width), static_cast<float>(scan.height));  // generous
  const float widest = reach_px(part_half, corner, nearest) / kTileSide;
  levels_built_ = 1;
  while (levels_built_ < levels_.size() &&
         static_cast<float>(levels_[levels_built_ - 1].radius_tiles) < widest) {
    const int radius = kRadiiTiles[levels_built_], before = kRadiiTiles[levels_built_ - 1];
    spread(levels_[levels_built_ - 1], levels_[levels_built_], radius - before);
    ++levels_built_;
  }
}

/// Truncation bands of the tiles themselves, then spread by one tile.
void DepthBounds::fill_first_level(const PreparedDepth& depth, const TruncationModel& truncation) {
  Level bands;
  const auto size = static_cast<std::size_t>(stride) * static_cast<std::size_t>(rows);
  bands.near_m.assign(size, kSeesNothingNear);
  bands.far_m.assign(size, kSeesNothingFar);
  for (int y = 0; y < depth.tiles_y; ++y)
    for (int x = 0; x < depth.tiles_x; ++x) {
      const auto tile = static_cast<std::size_t>(y * depth.tiles_x + x);
      const auto at = static_cast<std::size_t>((y + kPad) * stride + x + kPad);
      const float low = depth.tile_min_m[tile], high = depth.tile_max_m[tile];
      if (high == PreparedDepth::kOpen) bands.near_m[at] = bands.far_m[at] = PreparedDepth::kFarM;
      if (high <= 0) continue;
      const float tau = std::max(truncation.at(low), truncation.at(high));
      bands.near_m[at] = low - tau;
      bands.far_m[at] = high + tau;
    }
  spread(bands, levels_[0], kRadiiTiles[0]);
}

/// Each tile takes the extremes of the square of tiles around it: along rows, then along columns.
void DepthBounds::spread(const Level& from, Level& to, int by_tiles) {
  const std::size_t size = from.near_m.size(), width = static_cast<std::size_t>(stride);
  to.radius_tiles = from.radius_tiles + by_tiles;
  to.near_m = from.near_m;
  to.far_m = from.far_m;
  const auto take_in = [](std::vector<float>& into, const std::vector<float>& source, std::size_t offset,
                          auto pick) {
    const std::size_t n = into.size();
    float* out = into.data();
    const float* in = source.data();
    for (std::size_t i = offset; i < n; ++i) out[i] = pick(out[i], in[i - offset]);
    for (std::size_t i = 0; i + offset < n; ++i) out[i] = pick(out[i], in[i + offset]);
  };
  const auto lower = [](float a, float b) { return a < b ? a : b; };
  const auto higher = [](float a, float b) { return a > b ? a : b; };
  for (const std::size_t step : {std::size_t{1}, width}) {
    scratch_near_ = to.near_m;
    scratch_far_ = to.far_m;
    for (int i = 1; i <= by_tiles; ++i) {
      take_in(to.near_m, scratch_near_, static_cast<std::size_t>(i) * step, lower);
      take_in(to.far_m, scratch_far_, static_cast<std::size_t>(i) * step, higher);
    }
  }
  HM_CHECK(to.near_m.size() == size);
}

const DepthBounds::Level* DepthBounds::level_for(const Eigen::Vector3f& origin) const {
  const Eigen::Vector3f centre = origin + volume_centre_;
  const float nearest = centre.z() - volume_half_.z();
  if (nearest < 0.05f) return nullptr;
  // The part farthest out in the picture bounds them all.
  const Eigen::Vector2f off_axis = centre.head<2>() - principal_px_ * centre.z();
  const Eigen::Vector2f outermost = (off_axis.cwiseAbs() + volume_half_.head<2>()) / nearest;
  const float reach_tiles = reach_px(part_half, outermost, nearest) / kTileSide;
  for (std::size_t i = 0; i < levels_built_; ++i)
    if (static_cast<float>(levels_[i].radius_tiles) >= reach_tiles) return &levels_[i];
  return nullptr;
}

PartMasks DepthBounds::parts_of(VolumeKey key) const {
  const Eigen::Vector3f origin = scan_.origin_of(key);
  if (origin.z() + volume_centre_.z() + volume_half_.z() <= 0) return {0, 0};  // behind the camera
  const Level* level = level_for(origin);
  if (!level) return {};
  return HWY_DYNAMIC_DISPATCH(PartsOf)(*this, *level, origin);
}

}  // namespace hm
#endif
