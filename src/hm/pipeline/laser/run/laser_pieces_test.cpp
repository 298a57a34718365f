#include "hm/pipeline/laser/run/laser_pieces.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "hm/laser/testing/ring_corridor.hpp"

namespace hm {
namespace {

using namespace laser_testing;

/// A drive around the ring corridor, a scan a metre; its poses turn by `bend_rad` too much after every metre.
struct BentDrive {
  Trajectory T_odom_base;
  ScanVisits visits;
};

BentDrive drive_around(double length_m, double bend_rad) {
  const PlanarWorld world = ring_corridor_world();
  BentDrive drive;
  Rng rng(3);
  SE2 T_odom_base = ring_corridor_pose(0);
  for (int i = 0; i < static_cast<int>(length_m); ++i) {
    const SE2 truth = ring_corridor_pose(i);
    if (i > 0)
      T_odom_base = T_odom_base * (ring_corridor_pose(i - 1).inverse() * truth) * SE2(0, 0, bend_rad);
    PlanarScan scan = planar_scan_of_world(world, truth, {181, std::numbers::pi, 30, 0.01}, rng);
    scan.stamp = Time::from_seconds(100 + i);
    drive.visits.add(scan, T_odom_base, 0);
    drive.T_odom_base.push_back({scan.stamp, T_odom_base.to_se3()});
  }
  return drive;
}

TEST(LaserPieces, ARunIsCutWhereNothingJoinsItsPoses) {
  const BentDrive drive = drive_around(100, 0);
  const auto at = [&](std::size_t pose) { return drive.T_odom_base[pose].stamp; };
  const auto pieces =
      consistent_pieces(drive.T_odom_base, {at(30), at(35), at(70)}, drive.visits, Time::from_seconds(90));
  ASSERT_EQ(pieces.size(), 3U);  // the five scans from 30 on are too few
  EXPECT_EQ(pieces[0].begin, at(0));
  EXPECT_EQ(pieces[0].end, at(29));
  EXPECT_EQ(pieces[1].begin, at(35));
  EXPECT_EQ(pieces[1].end, at(69));
  EXPECT_EQ(pieces[2].scans, 30U);
  EXPECT_NEAR(pieces[0].path_m, 29, 0.5);
  EXPECT_NEAR(pieces[1].begin_s, 45, 1e-9);
  EXPECT_NEAR(pieces[1].end_s, 79, 1e-9);
}

/// Two times around with poses that close, and with poses that bend: the second lap lies elsewhere, and no
/// piece holds a part of both.
TEST(LaserPieces, PiecesDoNotContradictThemselves) {
  const BentDrive good = drive_around(2 * kRingCorridor_m, 0);
  EXPECT_EQ(consistent_pieces(good.T_odom_base, {}, good.visits, {}).size(), 1U);
  const BentDrive bent = drive_around(2 * kRingCorridor_m, 0.004);
  const auto pieces = consistent_pieces(bent.T_odom_base, {}, bent.visits, {});
  ASSERT_GE(pieces.size(), 2U);
  std::size_t scans = 0;
  for (const LaserPiece& piece : pieces) {
    EXPECT_LT(piece.path_m, kRingCorridor_m + 10);
    EXPECT_GE(piece.scans, kLeastPieceScans);
    scans += piece.scans;
  }
  EXPECT_EQ(scans, bent.T_odom_base.size());
}

TEST(LaserPieces, ShortRunsHaveNone) {
  const BentDrive drive = drive_around(8, 0);
  EXPECT_TRUE(consistent_pieces(drive.T_odom_base, {}, drive.visits, {}).empty());
  EXPECT_TRUE(consistent_pieces({}, {}, ScanVisits(), {}).empty());
}

}  // namespace
}  // namespace hm
