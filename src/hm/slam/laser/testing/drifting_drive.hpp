#pragma once
#include <vector>

#include "hm/laser/testing/planar_world.hpp"
#include "hm/slam/laser/scan_graph_2d.hpp"

namespace hm::laser_testing {

/// Path with drifting odometry: true and estimated poses of each keyframe, with its scan.
struct TestDrive {
  std::vector<SE2> truth;
  std::vector<GraphKeyframe2D> keyframes;
};

inline constexpr double kDriftPerStep_rad = 0.004;
inline constexpr TestLaser kDriveLaser{361, 4.71, 30, 0.01};

/// Odometry is 1 % too long, turns too far at each step, and is shifted.
TestDrive drive(const PlanarWorld& world, const std::vector<SE2>& path, const TestLaser& laser,
                double drift_per_step_rad = kDriftPerStep_rad, const Vec2& shift_per_step_m = {0, 0});

/// The graph of a drive, its loops closed.
ScanGraph2D closed_graph(const TestDrive& run);

/// Once around the corridor of `office_world`, and more than half of it again, a pose every half metre.
std::vector<SE2> two_rounds();

}  // namespace hm::laser_testing
