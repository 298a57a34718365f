#include "hm/slam/laser/scan_agreement.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hm {
namespace {

/// A wall 4 m ahead, and before it legs of chairs, 3 cm wide, every 0.6 m, seen by beams every half degree.
PlanarScan wall_behind_legs(const SE2& pose) {
  constexpr double kWall_m = 4, kLegs_m = 2.5, kApart_m = 0.6, kHalfWidth_m = 0.015;
  PlanarScan scan;
  for (int i = -100; i <= 100; ++i) {
    const double bearing = i * 0.0087, heading = pose.angle() + bearing;
    const auto range_at = [&](double x) { return (x - pose.translation().x()) / std::cos(heading); };
    const double y = pose.translation().y() + range_at(kLegs_m) * std::sin(heading);
    const bool on_leg = std::abs(std::remainder(y, kApart_m)) < kHalfWidth_m;
    const double range = range_at(on_leg ? kLegs_m : kWall_m);
    scan.points_m.emplace_back(range * std::cos(bearing), range * std::sin(bearing));
    scan.bearings_rad.push_back(static_cast<float>(bearing));
    scan.ranges_m.push_back(static_cast<float>(range));
  }
  return scan;
}

double contradicted(const SE2& error, double edge_margin_m) {
  const SE2 pose(0.1, 0.3, 0.05);
  ScanAgreementLimits limits;
  limits.edge_margin_m = edge_margin_m;
  ScanAgreement sum;
  compare_scans(wall_behind_legs({}), wall_behind_legs(pose), error * pose, limits, sum);
  EXPECT_GT(sum.agrees + sum.seen_through, 40u);
  return sum.contradicted_ratio();
}

TEST(ScanAgreement, ASmallErrorMovesThinThingsIntoGapsUnlessEdgesAreLeftOut) {
  const SE2 small(0, 0.05, 0);
  EXPECT_GT(contradicted(small, 0), 0.03);
  EXPECT_EQ(contradicted(small, 0.1), 0);
}

TEST(ScanAgreement, AWallInFreeSpaceIsSeenBesideEdgesToo) {
  const SE2 large(-0.6, 0, 0);
  EXPECT_GT(contradicted(large, 0.1), 0.4);
  EXPECT_LT(contradicted({}, 0.1), 0.01);
}

}  // namespace
}  // namespace hm
