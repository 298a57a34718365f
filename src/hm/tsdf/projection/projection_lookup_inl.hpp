// Look-ups of voxel projection with Highway vectors. Included once per instruction set, hence the toggling
// include guard.
#if defined(HM_TSDF_PROJECTION_LOOKUP_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HM_TSDF_PROJECTION_LOOKUP_INL
#undef HM_TSDF_PROJECTION_LOOKUP_INL
#else
#define HM_TSDF_PROJECTION_LOOKUP_INL
#endif

#include <hwy/highway.h>

#include "hm/sensors/vectors_inl.hpp"
#include "hm/tsdf/projection/projection_scan.hpp"

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {

/// The scan's constants as vectors.
struct Constants {
  VF half_below, max_u, max_v, zero, quadratic, linear, constant, min_tau, max_tau, weight_numerator,
      edge_weight_numerator, margin, far_m, limit;
  VF units_per_m, weight_cap, color_band, carving_factor;
  VI width, tiles_x;
  bool fixed_truncation;  ///< and so are the weights
  VF fixed_weight, fixed_edge_weight;
  explicit HWY_INLINE Constants(const ProjectionScan& s) {
    const DF d;
    const DI di;
    half_below = hn::Set(d, -0.5f);
    max_u = hn::Set(d, s.max_u);
    max_v = hn::Set(d, s.max_v);
    zero = hn::Zero(d);
    quadratic = hn::Set(d, s.truncation.quadratic);
    linear = hn::Set(d, s.truncation.linear);
    constant = hn::Set(d, s.truncation.constant);
    min_tau = hn::Set(d, s.truncation.min_m);
    max_tau = hn::Set(d, s.truncation.max_m);
    weight_numerator = hn::Set(d, s.weight_numerator);
    edge_weight_numerator = hn::Set(d, s.edge_weight_numerator);
    margin = hn::Set(d, s.carving_margin_m);
    limit = hn::Set(d, s.distance_limit_m);
    far_m = hn::Set(d, PreparedDepth::kFarM);
    units_per_m = hn::Set(d, s.sdf_units_per_m);
    weight_cap = hn::Set(d, s.weight_cap);
    color_band = hn::Set(d, s.color_band_m);
    carving_factor = hn::Set(d, s.carving_factor);
    width = hn::Set(di, s.width);
    tiles_x = hn::Set(di, s.tiles_x);
    fixed_truncation = s.truncation.min_m == s.truncation.max_m;
    fixed_weight = hn::ConvertTo(d, hn::NearestInt(hn::Div(weight_numerator, min_tau)));
    fixed_edge_weight = hn::ConvertTo(d, hn::NearestInt(hn::Div(edge_weight_numerator, min_tau)));
  }
};

/// Pixels of the voxels of a vector, and their readings: 0 for none, negative at edges.
struct Lookups {
  VI column, row, pixel;
  VF signed_depth;
};

HWY_INLINE Lookups LookUp(const ProjectionScan& scan, const Constants& c, VF hx, VF hy, VF hz) {
  const DF d;
  Lookups l;
  const VF inverse = hn::Div(hn::Set(d, 1.0f), hz);
  const VF u = hn::Mul(hx, inverse), v = hn::Mul(hy, inverse);
  const MF inside = hn::And(hn::And(hn::Gt(hz, c.zero), hn::And(hn::Ge(u, c.half_below), hn::Lt(u, c.max_u))),
                            hn::And(hn::Ge(v, c.half_below), hn::Lt(v, c.max_v)));
  l.column = hn::NearestInt(hn::IfThenElseZero(inside, u));
  l.row = hn::NearestInt(hn::IfThenElseZero(inside, v));
  l.pixel = hn::Add(hn::Mul(l.row, c.width), l.column);
  l.signed_depth = hn::IfThenElseZero(inside, hn::GatherIndex(d, scan.depth_m, l.pixel));
  return l;
}

/// Positions of voxels at depth z relative to their readings.
struct Comparison {
  VF u, tau;    ///< in front by u; truncation
  MF hit;       ///< in the truncation band
  MF observed;  ///< in the band or in front of it
  MF beyond;    ///< in front of the band by more than the margin, or of a reading beyond far
  MF in_range;  ///< the reading is not beyond far
};

HWY_INLINE Comparison Compare(const Constants& c, VF signed_depth, VF z) {
  const VF depth = hn::Abs(signed_depth);
  const VF polynomial = hn::Add(hn::Mul(hn::Add(hn::Mul(c.quadratic, depth), c.linear), depth), c.constant);
  Comparison found;
  found.u = hn::Sub(depth, z);
  found.tau = hn::Min(hn::Max(polynomial, c.min_tau), c.max_tau);
  const MF valid = hn::Gt(depth, c.zero);
  found.in_range = hn::Lt(depth, c.far_m);
  found.observed = hn::And(hn::And(valid, found.in_range), hn::Ge(found.u, hn::Neg(found.tau)));
  found.hit = hn::And(found.observed, hn::Le(found.u, found.tau));
  found.beyond = hn::And(valid, hn::Gt(found.u, hn::Add(found.tau, c.margin)));
  return found;
}

HWY_INLINE MF ColorLanes(const Constants& c, const Comparison& l) {
  return hn::And(l.hit, hn::And(hn::Ge(l.u, hn::Neg(c.color_band)), hn::Le(l.u, c.color_band)));
}

/// Weight of observations, in 1/kWeightOne.
HWY_INLINE VF WeightOf(const Constants& c, VF signed_depth, VF tau) {
  const MF at_edge = hn::Lt(signed_depth, c.zero);
  if (c.fixed_truncation) return hn::IfThenElse(at_edge, c.fixed_edge_weight, c.fixed_weight);
  const VF numerator = hn::IfThenElse(at_edge, c.edge_weight_numerator, c.weight_numerator);
  return hn::ConvertTo(DF(), hn::NearestInt(hn::Div(numerator, tau)));
}

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();
#endif
