#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "hm/laser/testing/ring_corridor.hpp"
#include "hm/pipeline/laser/laser_pipeline.hpp"

namespace hm {
namespace {

using namespace laser_testing;

const TestLaser kHalfTurnLaser{181, std::numbers::pi, 30, 0.01};

/// A drive: where the vehicle is when it scans, what its wheels say (nothing: it has none), and the time
/// between scans.
struct RingDrive {
  std::vector<SE2> truth;
  std::vector<SE2> wheels;
  double step_s = 0.9;
};

struct RingResult {
  double worst_m = 0, worst_odom_m = 0;  // from the true pose, both relative to the first scan
  std::size_t posed = 0, loops = 0;
};

RingResult run_ring(const PlanarWorld& world, const RingDrive& drive) {
  LaserPipeline pipeline({}, {{LaserRig{}}, false, !drive.wheels.empty()});
  Rng rng(5);
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    const Time stamp = Time::from_seconds(100 + drive.step_s * static_cast<double>(i));
    if (!drive.wheels.empty()) pipeline.add_odometry({stamp, drive.wheels[i].to_se3()});
    LaserScan scan = scan_world(world, drive.truth[i], kHalfTurnLaser, rng);
    scan.stamp = stamp;
    pipeline.add_scan(std::move(scan));
  }
  pipeline.finish();
  RingResult result;
  std::size_t i = 0;
  for (const LaserStep& step : pipeline.take_steps()) {
    const SE2 truth = drive.truth.front().inverse() * drive.truth[i++];
    if (!step.T_odom_base) continue;
    ++result.posed;
    const SE2 T_odom_base = SE2::from_se3(*step.T_odom_base);
    const SE2 T_map_base = pipeline.map_frame().T_map_odom_at(step.stamp, T_odom_base) * T_odom_base;
    result.worst_odom_m =
        std::max(result.worst_odom_m, (T_odom_base.translation() - truth.translation()).norm());
    result.worst_m = std::max(result.worst_m, (T_map_base.translation() - truth.translation()).norm());
  }
  result.loops = pipeline.map_frame().loops()->graph().statistics().accepted;
  return result;
}

std::vector<SE2> around(double length_m, double step_m) {
  std::vector<SE2> path;
  for (double at_m = 0; at_m < length_m; at_m += step_m) path.push_back(ring_corridor_pose(at_m));
  return path;
}

/// Wheels whose heading errs after every step: by a random angle, and by a fixed one.
std::vector<SE2> wheels_with_heading_noise(const std::vector<SE2>& truth, double sigma_rad, double bias_rad) {
  Rng rng(11);
  std::vector<SE2> wheels{truth.front()};
  for (std::size_t i = 1; i < truth.size(); ++i)
    wheels.push_back(wheels.back() * (truth[i - 1].inverse() * truth[i]) *
                     SE2(0, 0, sigma_rad * rng.normal() + bias_rad));
  return wheels;
}

/// Twice around the ring; reported as properties of the test, so that a failure shows how far off it is.
RingResult expect_closed(const PlanarWorld& world, const RingDrive& drive, double worst_m) {
  const RingResult result = run_ring(world, drive);
  ::testing::Test::RecordProperty("worst_mm", static_cast<int>(1000 * result.worst_m));
  EXPECT_GT(result.posed, drive.truth.size() * 98 / 100);
  EXPECT_LT(result.worst_m, worst_m) << "odom " << result.worst_odom_m << ", loops " << result.loops;
  return result;
}

TEST(LaserRing, HeadingNoiseOfWheels) {
  RingDrive drive{around(2 * kRingCorridor_m, 1.0), {}};
  drive.wheels = wheels_with_heading_noise(drive.truth, 0.15, 0);
  EXPECT_GT(expect_closed(ring_corridor_world(), drive, 0.5).loops, 30U);
}

/// The wheels' heading is that of half a step before the scan.
TEST(LaserRing, HeadingReadLate) {
  RingDrive drive{around(2 * kRingCorridor_m, 1.0), {}};
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    const SE2 before = ring_corridor_pose(std::max(0.0, static_cast<double>(i) - 0.5));
    drive.wheels.emplace_back(drive.truth[i].translation(), before.angle());
  }
  EXPECT_GT(expect_closed(ring_corridor_world(), drive, 0.5).loops, 30U);
}

/// Around, then back the same way: a laser that sees half of the surroundings looks the other way there.
TEST(LaserRing, ThereAndBack) {
  RingDrive drive{around(kRingCorridor_m, 1.0), {}};
  const std::vector<SE2> there = drive.truth;
  const SE2 end = there.back();
  for (int i = 1; i < 6; ++i) drive.truth.push_back(end * SE2(0, 0, i * std::numbers::pi / 6));
  for (std::size_t i = there.size(); i-- > 0;) drive.truth.push_back(there[i] * SE2(0, 0, std::numbers::pi));
  drive.wheels = wheels_with_heading_noise(drive.truth, 0.01, 0.004);
  EXPECT_GT(expect_closed(ring_corridor_world(), drive, 0.5).loops, 0U);
}

TEST(LaserRing, NoWheelsAtTwoHertz) {
  const RingDrive drive{around(2 * kRingCorridor_m, 0.9 / 2.3), {}, 1 / 2.3};
  EXPECT_GT(expect_closed(ring_corridor_world(), drive, 0.5).loops, 30U);
}

/// A round corridor, 2.5 m wide, whose walls stand back by 0.3 m at equal niches every 3 m.
struct RoundCorridor {
  static constexpr double kRadius_m = 20, kHalfWidth_m = 1.25, kNiche_m = 0.9, kDepth_m = 0.3;
  static constexpr int kNiches = 42, kPiecesOfWall = 8;
  PlanarWorld world;

  RoundCorridor() {
    add_wall(kRadius_m - kHalfWidth_m, -kDepth_m);
    add_wall(kRadius_m + kHalfWidth_m, kDepth_m);
  }
  void add_wall(double radius_m, double depth_m) {
    std::vector<Vec2> corners;
    const double turn_rad = 2 * std::numbers::pi / kNiches, niche_rad = kNiche_m / radius_m;
    for (int niche = 0; niche < kNiches; ++niche) {
      const SE2 T(0, 0, niche * turn_rad);
      const auto corner = [&](double r, double angle) {
        corners.push_back(T * SE2(0, 0, angle) * Vec2(r, 0));
      };
      for (const double r : {radius_m, radius_m + depth_m}) corner(r, 0);
      for (const double r : {radius_m + depth_m, radius_m}) corner(r, niche_rad);
      for (int i = 1; i < kPiecesOfWall; ++i)
        corner(radius_m, niche_rad + (turn_rad - niche_rad) * i / kPiecesOfWall);
    }
    world.add_polygon(corners);
  }
  /// On a line that sways, facing along the corridor.
  static SE2 pose(double distance_m) {
    const double angle = distance_m / kRadius_m, radius_m = kRadius_m + 0.4 * std::sin(7.3 * angle);
    return SE2(0, 0, angle) * SE2(radius_m, 0, std::numbers::pi / 2);
  }
};

/// A laser that sees what lies ahead comes to the begin of its map one niche early: the true place shows less
/// of the map than the next one does, and both look the same. Each needs its turn.
TEST(LaserRing, EqualNichesOfARoundCorridor) {
  RingDrive drive;
  for (double at_m = 0; at_m < 2.2 * 2 * std::numbers::pi * RoundCorridor::kRadius_m; at_m += 0.5)
    drive.truth.push_back(RoundCorridor::pose(at_m));
  drive.wheels = wheels_with_heading_noise(drive.truth, 0.004, 0.0005);
  const RingResult result = expect_closed(RoundCorridor().world, drive, 0.4);
  EXPECT_GT(result.loops, 10U);
  EXPECT_LT(result.worst_odom_m, 1.5);  // half a niche: which one it is can be told
}

/// In a square room every quarter turn looks the same: the wheels tell which one it was.
TEST(LaserRing, SymmetricRoomWithCleanWheels) {
  PlanarWorld room;
  room.add_box({-4, -4}, {4, 4});
  RingDrive drive;
  SE2 pose(-1, -1, 0);
  for (int i = 0; i < 120; ++i) {
    drive.truth.push_back(pose);
    pose = pose * (i % 3 == 2 ? SE2(0, 0, 0.5 * std::numbers::pi) : SE2(0.6, 0, 0));
  }
  drive.wheels = drive.truth;
  expect_closed(room, drive, 0.1);
}

}  // namespace
}  // namespace hm
