#include "hm/slam/laser/scan_visits.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "hm/core/statistics.hpp"

namespace hm {
namespace {

constexpr double kSpacing_m = 0.5, kSpacing_rad = 0.5;
constexpr std::size_t kMaxPoints = 180;
/// The margin is twice the error of a good map.
constexpr ScanAgreementLimits kComparedVisits{.edge_margin_m = 0.1};
constexpr std::size_t kMinPointsOfVisits = 50;

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
    VisitAgreement sum{{}, visit.scan.stamp, poses[i].translation()};
    for (const std::size_t j : thinned(std::move(others), kMaxPartners)) {
      const SE2 T_other_this = poses[j].inverse() * poses[i];
      compare_scans(visits_[j].scan, visit.scan, T_other_this, kComparedVisits, sum);
    }
    if (sum.agrees + sum.seen_through >= kMinPointsOfVisits) found.push_back(sum);
  }
  return found;
}

}  // namespace hm
