#include "hm/slam/laser/scan_submaps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "hm/core/statistics.hpp"

namespace hm {
namespace {

constexpr std::size_t kBeams = 720;  // of a submap's scan
constexpr std::size_t kKeptRasters = 16;
constexpr int kRasterLevels = 7;
/// Neighbouring points farther apart leave holes in the raster: the space between them does not count as
/// observed.
constexpr double kDenseSigmas = 2.5;

/// Distance to the closer one of the two neighbours in order of bearing.
double gap_beside(const std::vector<Vec2>& points, std::size_t i) {
  double gap = std::numeric_limits<double>::infinity();
  if (i > 0) gap = (points[i] - points[i - 1]).norm();
  if (i + 1 < points.size()) gap = std::min(gap, (points[i + 1] - points[i]).norm());
  return gap;
}

}  // namespace

std::vector<Vec2> points_within(const PlanarScan& scan, double range_m, std::size_t max_points) {
  std::vector<Vec2> near;
  for (const Vec2& point : scan.points_m)
    if ((point - scan.origin_m).norm() <= range_m) near.push_back(point);
  return thinned(std::move(near), max_points);
}

PlanarScan submap_scan(const ScanSubmap& submap, std::span<const GraphKeyframe2D> keyframes,
                       const SE2& T_odom_base, const Vec2& origin_m) {
  struct Beam {
    double range_m = std::numeric_limits<double>::infinity();
    Vec2 point_m;
  };
  std::array<Beam, kBeams> beams;
  const SE2 T_base_odom = T_odom_base.inverse();
  for (std::size_t k = submap.first; k < submap.end; ++k) {
    const SE2 T_base_k = T_base_odom * keyframes[k].T_odom_base;
    for (const Vec2& point : keyframes[k].scan.points_m) {
      const Vec2 seen = T_base_k * point - origin_m;
      const double turn = std::atan2(seen.y(), seen.x()) / (2 * std::numbers::pi) + 0.5;
      Beam& beam = beams[std::min(static_cast<std::size_t>(turn * kBeams), kBeams - 1)];
      if (seen.norm() < beam.range_m) beam = {seen.norm(), seen + origin_m};
    }
  }
  PlanarScan scan{keyframes[submap.anchor()].scan.stamp, origin_m, {}, {}, {}};
  for (const Beam& beam : beams)
    if (std::isfinite(beam.range_m)) scan.points_m.push_back(beam.point_m);
  sort_by_bearing(scan);
  return scan;
}

const SubmapRasters::Raster& SubmapRasters::raster(const ScanSubmap& submap,
                                                   std::span<const GraphKeyframe2D> keyframes) {
  const auto found = std::ranges::find(kept_, submap.first, &Raster::first);
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
    return kept_.front();
  }
  std::vector<Vec2> points_m;
  std::vector<SeenBeam> beams;
  const SE2 T_anchor_odom = keyframes[submap.anchor()].T_odom_base.inverse();
  for (std::size_t k = submap.first; k < submap.end; ++k) {
    const SE2 T_anchor_base = T_anchor_odom * keyframes[k].T_odom_base;
    const std::vector<Vec2> near =
        points_within(keyframes[k].scan, params_.kMaxPointRange_m, std::numeric_limits<std::size_t>::max());
    for (std::size_t i = 0; i < near.size(); ++i) {
      points_m.push_back(T_anchor_base * near[i]);
      if (gap_beside(near, i) <= kDenseSigmas * params_.kRasterSigma_m)
        beams.push_back({T_anchor_base * keyframes[k].scan.origin_m, points_m.back()});
    }
  }
  if (kept_.size() >= kKeptRasters) kept_.pop_back();
  kept_.push_front(
      {submap.first,
       CorrelativeMap(points_m, {params_.kRasterResolution_m, params_.kRasterSigma_m, kRasterLevels},
                      ObservedArea(beams))});
  return kept_.front();
}

}  // namespace hm
