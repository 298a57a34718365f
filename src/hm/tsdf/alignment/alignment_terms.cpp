// Distances, gradients and normal equations of dense alignment, with vectors (Highway): compiled once per
// instruction set. There are 16 partial sums for any vector width, so that all sets give the same bits.
#include "hm/tsdf/alignment/alignment_terms.hpp"

#include <algorithm>
#include <cmath>

#include "hm/sensors/round_up.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hm/tsdf/alignment/alignment_terms.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "hm/sensors/vectors_inl.hpp"

#ifndef HM_TSDF_ALIGNMENT_BLOCK
#define HM_TSDF_ALIGNMENT_BLOCK
namespace hm {
inline constexpr std::size_t kAlignmentBlock = 256;
/// 21 of H (upper triangle, row by row), 6 of b, then the sums in the order of AlignmentTerms.
inline constexpr std::size_t kAlignmentSums = 32;

/// A block of readings at a pose.
struct AlignmentBlock {
  alignas(64) float arm[3][kAlignmentBlock];       ///< from the centre of turning, world axes, metres
  alignas(64) float ray[3][kAlignmentBlock];       ///< from the camera
  alignas(64) float fraction[3][kAlignmentBlock];  ///< within the eight voxels
  alignas(64) float sums[kAlignmentSums][kAlignmentLanes];
  std::uint16_t moved[kAlignmentBlock];  ///< readings whose eight voxels are others than before
  std::size_t moved_count = 0;
};
}  // namespace hm
#endif

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Transforms the readings [begin, begin + count) and records those that moved to other voxels. `count` is a
/// multiple of kAlignmentLanes.
void PlaceReadings(const AlignmentView& view, std::size_t begin, std::size_t count, AlignmentPoints& points,
                   AlignmentBlock& block) {
  const DF d;
  const DI di;
  const std::size_t lanes = hn::Lanes(d);
  const VF per_voxel = hn::Set(d, 1.0f / view.voxel_size_m);
  block.moved_count = 0;
  std::int32_t* cells[3] = {points.cell_x.data(), points.cell_y.data(), points.cell_z.data()};
  for (std::size_t i = 0; i < count; i += lanes) {
    const VF x = hn::LoadU(d, points.x_m.data() + begin + i), y = hn::LoadU(d, points.y_m.data() + begin + i),
             z = hn::LoadU(d, points.z_m.data() + begin + i);
    MF same = hn::FirstN(d, lanes);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* row = view.R + 3 * axis;
      const VF ray = hn::Add(hn::Add(hn::Mul(x, hn::Set(d, row[0])), hn::Mul(y, hn::Set(d, row[1]))),
                             hn::Mul(z, hn::Set(d, row[2])));
      const VF arm = hn::Add(ray, hn::Set(d, view.t_centre_m[axis]));
      const VF place = hn::Add(hn::Mul(arm, per_voxel), hn::Set(d, view.centre_voxel[axis]));
      const VF bounded = hn::Min(hn::Max(place, hn::Set(d, -1e6f)), hn::Set(d, 1e6f));
      const VF low = hn::Floor(bounded);
      hn::Store(ray, d, block.ray[axis] + i);
      hn::Store(arm, d, block.arm[axis] + i);
      hn::Store(hn::Sub(bounded, low), d, block.fraction[axis] + i);
      const VI cell = hn::Add(hn::ConvertTo(di, low), hn::Set(di, view.first_voxel[axis]));
      std::int32_t* const kept = cells[axis] + begin + i;
      same = hn::And(same, hn::RebindMask(d, hn::Eq(cell, hn::LoadU(di, kept))));
      hn::StoreU(cell, di, kept);
    }
    for (std::uint32_t moved = ~MaskBits(same) & ((1u << lanes) - 1u); moved != 0; moved &= moved - 1)
      block.moved[block.moved_count++] =
          static_cast<std::uint16_t>(i + hwy::Num0BitsBelowLS1Bit_Nonzero32(moved));
  }
}

/// A distance from the surface and the unit normal there.
struct SurfaceLanes {
  VF distance_m;
  VF normal[3];
  MF usable;
};

/// Trilinear distance and gradient of a vector of readings (4.2.8).
HWY_INLINE SurfaceLanes Surface(const AlignmentView& view, const AlignmentPoints& points,
                                const AlignmentBlock& block, std::size_t begin, std::size_t i) {
  const DF d;
  const DI di;
  const hn::Rebind<std::int16_t, DF> d16;
  VF corner[8];
  VI lowest = hn::Zero(di);
  for (std::size_t c = 0; c < 8; ++c) {
    const VI units = hn::PromoteTo(di, hn::LoadU(d16, points.corners[c].data() + begin + i));
    lowest = hn::Min(lowest, units);
    corner[c] = hn::ConvertTo(d, units);
  }
  const VF fx = hn::Load(d, block.fraction[0] + i), fy = hn::Load(d, block.fraction[1] + i),
           fz = hn::Load(d, block.fraction[2] + i);
  const auto blend = [](VF a, VF b, VF f) HWY_ATTR { return hn::Add(a, hn::Mul(hn::Sub(b, a), f)); };
  // Along x for the four (y, z) edges, then y, then z; differences on the way give the gradient.
  const VF x00 = blend(corner[0], corner[1], fx), x10 = blend(corner[2], corner[3], fx),
           x01 = blend(corner[4], corner[5], fx), x11 = blend(corner[6], corner[7], fx);
  const VF y0 = blend(x00, x10, fy), y1 = blend(x01, x11, fy);
  const VF units = blend(y0, y1, fz);
  const VF gx = blend(blend(hn::Sub(corner[1], corner[0]), hn::Sub(corner[3], corner[2]), fy),
                      blend(hn::Sub(corner[5], corner[4]), hn::Sub(corner[7], corner[6]), fy), fz);
  const VF gy = blend(hn::Sub(x10, x00), hn::Sub(x11, x01), fz), gz = hn::Sub(y1, y0);
  const VF slope2 = hn::Add(hn::Add(hn::Mul(gx, gx), hn::Mul(gy, gy)), hn::Mul(gz, gz));
  const VF facing =
      hn::Add(hn::Add(hn::Mul(gx, hn::Load(d, block.ray[0] + i)), hn::Mul(gy, hn::Load(d, block.ray[1] + i))),
              hn::Mul(gz, hn::Load(d, block.ray[2] + i)));
  const MF known = hn::RebindMask(d, hn::Gt(lowest, hn::Set(di, kUnknownDistance)));
  const MF near = hn::Lt(hn::Abs(units), hn::Set(d, view.near_surface_units));
  const MF steep = hn::Gt(slope2, hn::Set(d, view.min_slope2_units));
  const MF seen_from_outside = hn::Lt(facing, hn::Zero(d));
  const VF inverse = hn::Div(hn::Set(d, 1.0f), hn::Sqrt(hn::Max(slope2, hn::Set(d, view.min_slope2_units))));
  return {hn::Mul(hn::Mul(units, inverse), hn::Set(d, view.voxel_size_m)),
          {hn::Mul(gx, inverse), hn::Mul(gy, inverse), hn::Mul(gz, inverse)},
          hn::And(hn::And(known, near), hn::And(steep, seen_from_outside))};
}

/// Adds a vector of readings to the sums, masked by `counted`.
HWY_INLINE void AddReadings(const AlignmentBlock& block, std::size_t i, const SurfaceLanes& at,
                            VF inverse_width, VF share, MF counted, float* sums) {
  const DF d;
  const VF one = hn::Set(d, 1.0f);
  const VF r = hn::Mul(at.distance_m, inverse_width);  // in widths of the robust function
  const VF r2 = hn::Mul(r, r);
  const MF on_map = hn::And(at.usable, counted);
  const MF agreeing = hn::And(on_map, hn::Lt(r2, one));
  // Tukey's biweight: cost 1 - (1 - r^2)^3, weight (1 - r^2)^2.
  const VF rest = hn::IfThenElseZero(agreeing, hn::Sub(one, r2));
  const VF rest2 = hn::Mul(rest, rest);
  const VF weight = hn::Mul(hn::Mul(rest2, share), hn::Mul(inverse_width, inverse_width));
  const VF ax = hn::Load(d, block.arm[0] + i), ay = hn::Load(d, block.arm[1] + i),
           az = hn::Load(d, block.arm[2] + i);
  const VF nx = at.normal[0], ny = at.normal[1], nz = at.normal[2];
  const VF jacobian[6] = {nx,
                          ny,
                          nz,
                          hn::Sub(hn::Mul(ay, nz), hn::Mul(az, ny)),
                          hn::Sub(hn::Mul(az, nx), hn::Mul(ax, nz)),
                          hn::Sub(hn::Mul(ax, ny), hn::Mul(ay, nx))};
  const auto add = [&](std::size_t place, VF value) HWY_ATTR {
    float* const sum = sums + place * kAlignmentLanes;
    hn::Store(hn::Add(hn::Load(d, sum), value), d, sum);
  };
  std::size_t next = 0;
  for (std::size_t row = 0; row < 6; ++row) {
    const VF weighted = hn::Mul(jacobian[row], weight);
    for (std::size_t column = row; column < 6; ++column) add(next++, hn::Mul(weighted, jacobian[column]));
    add(21 + row, hn::Mul(weighted, at.distance_m));
  }
  add(27, weight);
  add(28, hn::IfThenElseZero(counted, hn::Mul(share, hn::Sub(one, hn::Mul(rest2, rest)))));
  add(29, hn::IfThenElseZero(on_map, one));
  add(30, hn::IfThenElseZero(agreeing, one));
  add(31, hn::IfThenElseZero(agreeing, hn::Mul(at.distance_m, at.distance_m)));
}

/// Sums up the readings [begin, end), which PlaceReadings() placed.
void SumReadings(const AlignmentView& view, std::size_t begin, std::size_t end, const AlignmentPoints& points,
                 AlignmentBlock& block) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  for (auto& sum : block.sums) std::fill(std::begin(sum), std::end(sum), 0.0f);
  for (std::size_t i = 0; begin + i < end; i += lanes) {
    const MF counted = hn::FirstN(d, std::min(lanes, end - begin - i));
    const SurfaceLanes at = Surface(view, points, block, begin, i);
    // The partial sum of a lane depends on the reading, not on the vector width.
    float* const sums = &block.sums[0][i % kAlignmentLanes];
    AddReadings(block, i, at, hn::LoadU(d, points.inverse_width.data() + begin + i),
                hn::LoadU(d, points.share.data() + begin + i), counted, sums);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hm {
HWY_EXPORT(PlaceReadings);
HWY_EXPORT(SumReadings);

namespace {

/// Adds the sums of a block in double precision.
void add_block(const AlignmentBlock& block, std::array<double, kAlignmentSums>& total) {
  for (std::size_t i = 0; i < kAlignmentSums; ++i)
    for (const float part : block.sums[i]) total[i] += static_cast<double>(part);
}

AlignmentTerms terms_of(const std::array<double, kAlignmentSums>& total) {
  AlignmentTerms terms;
  std::size_t place = 0;
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column)
      terms.H(row, column) = terms.H(column, row) = total[place++];
    terms.b[row] = total[21 + static_cast<std::size_t>(row)];
  }
  terms.weight = total[27], terms.cost = total[28], terms.on_map = total[29], terms.agreeing = total[30];
  terms.square_m2 = total[31];
  return terms;
}

}  // namespace

AlignmentView::AlignmentView(const SE3& T_world_camera, const Vec3& p_world_centre, const VolumeGrid& grid,
                             double distance_limit_m)
    : voxel_size_m(static_cast<float>(grid.voxel_size_m())) {
  near_surface_units = static_cast<float>(kNearSurface_ratio * distance_limit_m / grid.sdf_unit_m());
  min_slope2_units = static_cast<float>(std::pow(kLeastSlope * grid.voxel_size_m() / grid.sdf_unit_m(), 2));
  const Vec3 centre = p_world_centre / grid.voxel_size_m() - Vec3::Constant(0.5);
  const Vec3 t = T_world_camera.translation() - p_world_centre;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double first = std::floor(centre[axis]);
    first_voxel[axis] = static_cast<std::int32_t>(first);
    centre_voxel[axis] = static_cast<float>(centre[axis] - first);
    t_centre_m[axis] = static_cast<float>(t[axis]);
    for (Eigen::Index column = 0; column < 3; ++column)
      R[3 * axis + column] = static_cast<float>(T_world_camera.rotation()(axis, column));
  }
}

AlignmentTerms sum_alignment_terms(const AlignmentView& view, std::size_t count, VoxelLookup& lookup,
                                   AlignmentPoints& points) {
  AlignmentBlock block;
  std::array<double, kAlignmentSums> total{};
  for (std::size_t begin = 0; begin < count; begin += kAlignmentBlock) {
    const std::size_t end = std::min(begin + kAlignmentBlock, count);
    const std::size_t padded = round_up(end - begin, kAlignmentLanes);
    HWY_DYNAMIC_DISPATCH(PlaceReadings)(view, begin, padded, points, block);
    for (std::size_t k = 0; k < block.moved_count; ++k) {
      const std::size_t i = begin + block.moved[k];
      std::int16_t distances[8];
      lookup.corners(points.cell_x[i], points.cell_y[i], points.cell_z[i], distances);
      for (std::size_t c = 0; c < 8; ++c) points.corners[c][i] = distances[c];
    }
    HWY_DYNAMIC_DISPATCH(SumReadings)(view, begin, end, points, block);
    add_block(block, total);
  }
  return terms_of(total);
}

}  // namespace hm
#endif
