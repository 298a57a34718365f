#include "hm/slam/laser/scan_agreement.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace hm {
namespace {

constexpr double kMinRange_m = 0.2;
/// Between two beams the surface is known when they are this close in bearing and in range.
constexpr double kMaxBearingGap_rad = 0.05, kMaxRangeStep_m = 0.15;

/// Range of the surface that a scan measured in a direction; nothing where it measured none, or an edge
/// within the margin to either side.
std::optional<double> surface_range(const PlanarScan& scan, double bearing_rad, double margin_rad) {
  constexpr double kTurn = 2 * std::numbers::pi;
  const auto& bearings = scan.bearings_rad;
  if (bearings.size() < 2) return std::nullopt;
  while (bearing_rad < bearings.front()) bearing_rad += kTurn;
  while (bearing_rad >= bearings.front() + kTurn) bearing_rad -= kTurn;
  const auto middle = static_cast<std::size_t>(
      std::ranges::upper_bound(bearings, static_cast<float>(bearing_rad)) - bearings.begin());
  std::size_t first = middle, last = middle;
  while (first > 0 && bearings[first - 1] > static_cast<float>(bearing_rad - margin_rad)) --first;
  while (last < bearings.size() && bearings[last] <= static_cast<float>(bearing_rad + margin_rad)) ++last;
  if (first == 0 || last == bearings.size()) return std::nullopt;
  for (std::size_t i = first; i <= last; ++i)
    if (bearings[i] - bearings[i - 1] > kMaxBearingGap_rad ||
        std::abs(scan.ranges_m[i] - scan.ranges_m[i - 1]) > kMaxRangeStep_m)
      return std::nullopt;
  return std::min(scan.ranges_m[middle - 1], scan.ranges_m[middle]);
}

/// Adds the points of one scan, seen from the other's laser.
void compare_points(const PlanarScan& points, const PlanarScan& beams, const SE2& T_beams_points,
                    const ScanAgreementLimits& limits, ScanAgreement& sum) {
  const std::size_t step =
      std::max<std::size_t>(1, (points.size() + limits.max_points - 1) / limits.max_points);
  for (std::size_t i = 0; i < points.size(); i += step) {
    if (points.ranges_m[i] > limits.max_range_m) continue;
    const Vec2 seen = T_beams_points * points.points_m[i] - beams.origin_m;
    const double range = seen.norm();
    if (range > limits.max_range_m || range < kMinRange_m) continue;
    const auto surface = surface_range(beams, std::atan2(seen.y(), seen.x()), limits.edge_margin_m / range);
    if (!surface) continue;
    const double tolerance = limits.tolerance_m + limits.tolerance_ratio * range;
    if (range < *surface - tolerance)
      ++sum.seen_through;
    else if (range <= *surface + tolerance)
      ++sum.agrees;
  }
}

}  // namespace

void compare_scans(const PlanarScan& a, const PlanarScan& b, const SE2& T_a_b,
                   const ScanAgreementLimits& limits, ScanAgreement& sum) {
  compare_points(a, b, T_a_b.inverse(), limits, sum);
  compare_points(b, a, T_a_b, limits, sum);
}

}  // namespace hm
