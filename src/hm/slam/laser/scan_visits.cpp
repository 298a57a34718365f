#include "hm/slam/laser/scan_visits.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "hm/core/statistics.hpp"

namespace hm {
namespace {

constexpr double kSpacing_m = 0.5, kSpacing_rad = 0.5;
constexpr std::size_t kMaxPoints = 180;
constexpr std::size_t kMinPointsInCommon = 50;
/// Points farther from either laser than this are not compared: a small error of heading moves them too far.
constexpr double kMaxRange_m = 10, kMinRange_m = 0.2;
/// A beam ends "at" a point within this distance, which grows with the range (heading, spread of the beam).
constexpr double kTolerance_m = 0.25, kToleranceRatio = 0.02;
/// Between two beams the surface is known when they are this close in bearing and in range.
constexpr double kMaxBearingGap_rad = 0.05, kMaxRangeStep_m = 0.15;

PlanarScan thinned_scan(const PlanarScan& scan) {
  const std::size_t step = std::max<std::size_t>(1, (scan.size() + kMaxPoints - 1) / kMaxPoints);
  if (step == 1) return scan;
  PlanarScan kept{scan.stamp, scan.origin_m, {}, {}, {}};
  for (std::size_t i = 0; i < scan.size(); i += step) {
    kept.points_m.push_back(scan.points_m[i]);
    kept.bearings_rad.push_back(scan.bearings_rad[i]);
    kept.ranges_m.push_back(scan.ranges_m[i]);
  }
  return kept;
}

/// Range of the surface that a scan measured in a direction; nothing where it measured none, or an edge.
std::optional<double> surface_range(const PlanarScan& scan, double bearing_rad) {
  constexpr double kTurn = 2 * std::numbers::pi;
  const auto& bearings = scan.bearings_rad;
  if (bearings.size() < 2) return std::nullopt;
  while (bearing_rad < bearings.front()) bearing_rad += kTurn;
  while (bearing_rad >= bearings.front() + kTurn) bearing_rad -= kTurn;
  const auto after = std::ranges::upper_bound(bearings, static_cast<float>(bearing_rad));
  if (after == bearings.end() || after == bearings.begin()) return std::nullopt;
  const auto i = static_cast<std::size_t>(after - bearings.begin());
  if (bearings[i] - bearings[i - 1] > kMaxBearingGap_rad) return std::nullopt;
  const double first = scan.ranges_m[i - 1], second = scan.ranges_m[i];
  if (std::abs(first - second) > kMaxRangeStep_m) return std::nullopt;
  return std::min(first, second);
}

/// Adds the points of one scan, seen from the other's laser. Points behind the surface are hidden.
void compare_points(const PlanarScan& points, const PlanarScan& beams, const SE2& T_beams_points,
                    VisitAgreement& sum) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points.ranges_m[i] > kMaxRange_m) continue;
    const Vec2 seen = T_beams_points * points.points_m[i] - beams.origin_m;
    const double range = seen.norm();
    if (range > kMaxRange_m || range < kMinRange_m) continue;
    const auto surface = surface_range(beams, std::atan2(seen.y(), seen.x()));
    if (!surface) continue;
    const double tolerance = kTolerance_m + kToleranceRatio * range;
    if (range < *surface - tolerance)
      ++sum.seen_through;
    else if (range <= *surface + tolerance)
      ++sum.agrees;
  }
}

/// Scans by the cell of the plane that they lie in.
class Places {
 public:
  explicit Places(const std::vector<SE2>& poses) {
    for (std::size_t i = 0; i < poses.size(); ++i) scans_[cell_of(poses[i].translation())].push_back(i);
  }
  /// Calls `take` with every scan in the cells around a place, in order of cells, then of time.
  template <class Take>
  void for_each_around(const Vec2& place, const Take& take) const {
    const Cell middle = cell_of(place);
    for (std::int64_t x = middle.first - 1; x <= middle.first + 1; ++x)
      for (std::int64_t y = middle.second - 1; y <= middle.second + 1; ++y)
        if (const auto found = scans_.find({x, y}); found != scans_.end())
          for (const std::size_t scan : found->second) take(scan);
  }

 private:
  using Cell = std::pair<std::int64_t, std::int64_t>;
  static Cell cell_of(const Vec2& place) {
    return {static_cast<std::int64_t>(std::floor(place.x() / ScanVisits::kNear_m)),
            static_cast<std::int64_t>(std::floor(place.y() / ScanVisits::kNear_m))};
  }
  std::map<Cell, std::vector<std::size_t>> scans_;
};

}  // namespace

void ScanVisits::add(const PlanarScan& scan, const SE2& T_odom_base, double height_m) {
  if (!visits_.empty()) {
    const SE2 moved = T_last_.inverse() * T_odom_base;
    if (moved.translation().norm() < kSpacing_m && std::abs(moved.angle()) < kSpacing_rad) return;
    path_m_ += moved.translation().norm();
  }
  T_last_ = T_odom_base;
  visits_.push_back({thinned_scan(scan), T_odom_base, height_m, path_m_});
}

std::vector<VisitAgreement> ScanVisits::compare(const Correction& T_map_base) const {
  std::vector<SE2> poses;
  poses.reserve(visits_.size());
  for (const Visit& visit : visits_) poses.push_back(T_map_base(visit.scan.stamp, visit.T_odom_base));
  const Places places(poses);
  std::vector<VisitAgreement> found;
  for (std::size_t i = 0; i < visits_.size(); ++i) {
    const Visit& visit = visits_[i];
    std::vector<std::size_t> others;
    places.for_each_around(poses[i].translation(), [&](std::size_t j) {
      if (std::abs(visits_[j].path_m - visit.path_m) > kVisitPath_m &&
          std::abs(visits_[j].height_m - visit.height_m) < kSameHeight_m &&
          (poses[j].translation() - poses[i].translation()).norm() < kNear_m)
        others.push_back(j);
    });
    VisitAgreement sum{visit.scan.stamp, poses[i].translation()};
    for (const std::size_t j : thinned(std::move(others), kMaxPartners)) {
      const SE2 T_other_this = poses[j].inverse() * poses[i];
      compare_points(visit.scan, visits_[j].scan, T_other_this, sum);
      compare_points(visits_[j].scan, visit.scan, T_other_this.inverse(), sum);
    }
    if (sum.agrees + sum.seen_through >= kMinPointsInCommon) found.push_back(sum);
  }
  return found;
}

}  // namespace hm
