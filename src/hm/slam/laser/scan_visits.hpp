#pragma once
#include <cstddef>
#include <functional>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/laser/matching/planar_scan.hpp"
#include "hm/slam/laser/scan_agreement.hpp"

namespace hm {

/// How well a scan agrees with those of other visits of the same place.
struct VisitAgreement : ScanAgreement {
  Time stamp;    ///< of the scan
  Vec2 place_m;  ///< of the vehicle, corrected
};

/// Scans along a path, for the question whether the map that they make contradicts itself: where a path
/// leads past a place again, walls of one visit must not stand in the free space of another. Needs no truth.
/// Keeps a scan every half metre or half radian, thinned to 180 points.
class ScanVisits {
 public:
  /// Length of path between two scans that count as different visits.
  static constexpr double kVisitPath_m = 10;
  /// Scans of different visits are compared when they were measured within this distance and height.
  static constexpr double kNear_m = 4, kSameHeight_m = 0.5;
  /// Most scans of other visits that one is compared with, evenly chosen.
  static constexpr std::size_t kMaxPartners = 16;

  /// Takes a scan with its pose of odometry into account. Stamps must increase.
  void add(const PlanarScan& scan, const SE2& T_odom_base, double height_m);
  [[nodiscard]] std::size_t size() const { return visits_.size(); }

  /// Corrected pose of a scan, from its stamp and its pose of odometry.
  using Correction = std::function<SE2(Time stamp, const SE2& T_odom_base)>;
  /// Compares the scans as `T_map_base` places them: one entry for each that has enough points in common with
  /// other visits, in order of time. Costs at most kMaxPartners comparisons of 180 points a scan.
  [[nodiscard]] std::vector<VisitAgreement> compare(const Correction& T_map_base) const;

 private:
  struct Visit {
    PlanarScan scan;
    SE2 T_odom_base;
    double height_m = 0, path_m = 0;
  };
  std::vector<Visit> visits_;
  SE2 T_last_;
  double path_m_ = 0;
};

}  // namespace hm
