#include "hm/tsdf/alignment/alignment_points.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "hm/sensors/round_up.hpp"

namespace hm {
namespace {

/// True where a surface continues in all four directions.
bool is_inner(const EdgeRule& rule, const DepthImage& depth, int x, int y) {
  const int here = depth.units(x, y), threshold = rule.threshold(static_cast<std::uint16_t>(here));
  const auto goes_on = [&](int nx, int ny) {
    const int there = depth.units(nx, ny);
    return there != 0 && (!rule.enabled || std::abs(there - here) <= threshold);
  };
  return goes_on(x - 1, y) && goes_on(x + 1, y) && goes_on(x, y - 1) && goes_on(x, y + 1);
}

/// Smoothed depth at a pixel, metres, as mean of the inverse depths around it, which are linear in the image
/// for a plane, like the quantised disparity of such sensors. Pixels are used in opposite pairs.
double smooth_depth_m(const EdgeRule& rule, const DepthImage& depth, int x, int y, int radius_px) {
  const std::uint16_t* const centre = depth.units.row(y).data() + x;
  const int here = *centre, threshold = rule.threshold(*centre);
  const std::ptrdiff_t width = depth.width();
  std::int64_t sum = 0, squares = 0;
  int count = 1;
  for (int dy = 0; dy <= radius_px; ++dy)
    for (int dx = dy == 0 ? 1 : -radius_px; dx <= radius_px; ++dx) {
      const std::ptrdiff_t step = dy * width + dx;
      const int a = centre[step], b = centre[-step], da = a - here, db = b - here;
      const int reach = threshold * std::max(std::abs(dx), dy);
      const bool both = a != 0 && b != 0 && std::abs(da) <= reach && std::abs(db) <= reach;
      sum += both ? da + db : 0;
      squares += both ? std::int64_t{da} * da + std::int64_t{db} * db : 0;
      count += both ? 2 : 0;
    }
  // 1 / (h + d) = (1 - d / h + d^2 / h^2 ...) / h; in pairs, the odd terms of a plane cancel.
  const double h = here, mean = static_cast<double>(sum) / (count * h),
               square = static_cast<double>(squares) / (count * h * h);
  return h / (1.0 - mean + square) * depth.unit_m;
}

void clear(AlignmentPoints& points) {
  for (auto* list : {&points.x_m, &points.y_m, &points.z_m, &points.variance_m2, &points.share})
    list->clear();
  points.round_end.clear();
}

/// Pads the arrays to whole blocks and resets the cached map data.
void fill_up(AlignmentPoints& points) {
  const std::size_t padded = round_up(points.size(), kAlignmentLanes);
  for (auto* list : {&points.x_m, &points.y_m, &points.z_m, &points.variance_m2, &points.share})
    list->resize(padded, 0.0f);
  points.inverse_width.assign(padded, 0.0f);
  for (auto* list : {&points.cell_x, &points.cell_y, &points.cell_z})
    list->assign(padded, AlignmentPoints::kNoCell);
  for (auto& list : points.corners) list.resize(padded);
}

}  // namespace

AlignmentSampler::AlignmentSampler(const AlignmentParams& params, const TsdfParams& tsdf,
                                   const DepthNoise& noise, const PinholeCamera& camera)
    : params_(params), tsdf_(tsdf), noise_(noise), camera_(camera) {}

void AlignmentSampler::choose(const DepthImage& depth, AlignmentPoints& points) const {
  clear(points);
  const EdgeRule rule(tsdf_, noise_, camera_, depth.unit_m);
  const int coarsest = std::max(params_.kCoarsestStride_px, params_.kFinestStride_px);
  const int margin_px = std::max(1, params_.kSmoothing_px);  // neighbours are read
  Grid grid{coarsest / 2, coarsest, 0};
  while (true) {
    for (int y = grid.first_px % grid.stride_px; y < depth.height() - margin_px; y += grid.stride_px)
      if (y >= margin_px) choose_row(rule, depth, y, grid, points);
    points.round_end.push_back(points.size());
    if (grid.stride_px / 2 < params_.kFinestStride_px) break;
    grid.coarser_px = grid.stride_px;
    grid.stride_px /= 2;
  }
  fill_up(points);
}

void AlignmentSampler::choose_row(const EdgeRule& rule, const DepthImage& depth, int y, const Grid& grid,
                                  AlignmentPoints& points) const {
  const bool row_was_chosen = grid.coarser_px > 0 && (y - grid.first_px) % grid.coarser_px == 0;
  const double near = tsdf_.near_m / depth.unit_m, far = tsdf_.far_m / depth.unit_m;
  const double map_variance_m2 = std::pow(params_.kMapSigma_voxel * tsdf_.voxel_size_m, 2);
  const int margin_px = std::max(1, params_.kSmoothing_px);
  for (int x = grid.first_px % grid.stride_px; x < depth.width() - margin_px; x += grid.stride_px) {
    if (x < margin_px || (row_was_chosen && (x - grid.first_px) % grid.coarser_px == 0)) continue;
    const std::uint16_t units = depth.units(x, y);
    if (units == 0 || units < near || units > far || !is_inner(rule, depth, x, y)) continue;
    const double z = smooth_depth_m(rule, depth, x, y, params_.kSmoothing_px), sigma = noise_.sigma_m(z);
    points.x_m.push_back(static_cast<float>((x - camera_.cx) / camera_.fx * z));
    points.y_m.push_back(static_cast<float>((y - camera_.cy) / camera_.fy * z));
    points.z_m.push_back(static_cast<float>(z));
    const double variance_m2 = sigma * sigma + map_variance_m2;
    const double systematic_m = params_.systematic_per_m * z * z;
    points.variance_m2.push_back(static_cast<float>(variance_m2));
    points.share.push_back(static_cast<float>(variance_m2 / (variance_m2 + systematic_m * systematic_m)));
  }
}

}  // namespace hm
