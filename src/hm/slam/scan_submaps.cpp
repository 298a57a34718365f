#include "hm/slam/scan_submaps.hpp"

#include <algorithm>
#include <limits>

namespace hm {
namespace {

constexpr std::size_t kKeptRasters = 16;
constexpr int kRasterLevels = 7;

}  // namespace

std::vector<Vec2> points_within(const PlanarScan& scan, double range_m, std::size_t max_points) {
  std::vector<Vec2> near;
  for (const Vec2& point : scan.points_m)
    if ((point - scan.origin_m).norm() <= range_m) near.push_back(point);
  if (near.size() <= max_points) return near;
  std::vector<Vec2> thinned;
  for (std::size_t i = 0; i < max_points; ++i) thinned.push_back(near[i * near.size() / max_points]);
  return thinned;
}

const CorrelativeMap& SubmapRasters::raster(const ScanSubmap& submap,
                                            std::span<const GraphKeyframe2D> keyframes) {
  const auto found = std::ranges::find(kept_, submap.first, &Kept::first);
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
    return kept_.front().map;
  }
  std::vector<Vec2> points_m;
  const SE2 T_anchor_odom = keyframes[submap.anchor()].T_odom_base.inverse();
  for (std::size_t k = submap.first; k < submap.end; ++k) {
    const SE2 T_anchor_base = T_anchor_odom * keyframes[k].T_odom_base;
    for (const Vec2& point :
         points_within(keyframes[k].scan, params_.max_point_range_m, std::numeric_limits<std::size_t>::max()))
      points_m.push_back(T_anchor_base * point);
  }
  if (kept_.size() >= kKeptRasters) kept_.pop_back();
  kept_.push_front({submap.first, CorrelativeMap(points_m, {params_.raster_resolution_m,
                                                            params_.raster_sigma_m, kRasterLevels})});
  return kept_.front().map;
}

}  // namespace hm
