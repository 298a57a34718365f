#include "hm/laser/matching/planar_scan.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace hm {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

void keep_usable(PlanarScan& scan) {
  const auto unusable = [&](const Vec2& point) { return !point.allFinite() || point == scan.origin_m; };
  scan.points_m.erase(std::remove_if(scan.points_m.begin(), scan.points_m.end(), unusable),
                      scan.points_m.end());
}

/// Bearings in the order of the points, each within pi of the one before it.
std::vector<double> unwrapped_bearings(const PlanarScan& scan) {
  std::vector<double> bearings(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Vec2 ray = scan.points_m[i] - scan.origin_m;
    const double bearing = std::atan2(ray.y(), ray.x());
    bearings[i] = i == 0 ? bearing : bearings[i - 1] + wrap_angle(bearing - bearings[i - 1]);
  }
  return bearings;
}

bool strictly_increasing_turn(const std::vector<double>& bearings) {
  for (std::size_t i = 1; i < bearings.size(); ++i)
    if (!(static_cast<float>(bearings[i]) > static_cast<float>(bearings[i - 1]))) return false;
  return bearings.empty() || bearings.back() - bearings.front() < kTwoPi;
}

/// Sorts by bearing, starting after the widest gap; of points with equal bearing the nearest is kept.
void sort_points(PlanarScan& scan, std::vector<double>& bearings) {
  for (double& bearing : bearings) bearing = wrap_angle(bearing);
  std::vector<std::size_t> order(bearings.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto squared_range = [&](std::size_t i) { return (scan.points_m[i] - scan.origin_m).squaredNorm(); };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return bearings[a] != bearings[b] ? bearings[a] < bearings[b] : squared_range(a) < squared_range(b);
  });
  std::size_t first = 0;
  double widest = bearings[order.front()] + kTwoPi - bearings[order.back()];
  for (std::size_t k = 1; k < order.size(); ++k) {
    const double gap = bearings[order[k]] - bearings[order[k - 1]];
    if (gap > widest) widest = gap, first = k;
  }
  std::rotate(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(first), order.end());
  std::vector<Vec2> points;
  std::vector<double> sorted;
  for (const std::size_t i : order) {
    const double turned =
        sorted.empty() || bearings[i] >= sorted.front() ? bearings[i] : bearings[i] + kTwoPi;
    if (!sorted.empty() && !(static_cast<float>(turned) > static_cast<float>(sorted.back()))) continue;
    points.push_back(scan.points_m[i]);
    sorted.push_back(turned);
  }
  scan.points_m = std::move(points);
  bearings = std::move(sorted);
}

}  // namespace

void sort_by_bearing(PlanarScan& scan) {
  keep_usable(scan);
  std::vector<double> bearings = unwrapped_bearings(scan);
  if (!strictly_increasing_turn(bearings)) sort_points(scan, bearings);
  scan.bearings_rad.assign(bearings.begin(), bearings.end());
  scan.ranges_m.resize(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i)
    scan.ranges_m[i] = static_cast<float>((scan.points_m[i] - scan.origin_m).norm());
}

}  // namespace hm
