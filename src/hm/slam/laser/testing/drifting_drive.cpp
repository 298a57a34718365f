#include "hm/slam/laser/testing/drifting_drive.hpp"

namespace hm::laser_testing {

TestDrive drive(const PlanarWorld& world, const std::vector<SE2>& path, const TestLaser& laser,
                double drift_per_step_rad, const Vec2& shift_per_step_m) {
  constexpr double kScale = 1.01;
  Rng rng(11);
  TestDrive result{path, {}};
  SE2 T_odom_base = path[0];
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i > 0) {
      const SE2 motion = path[i - 1].inverse() * path[i];
      T_odom_base = T_odom_base * SE2(kScale * motion.translation(), motion.angle() + drift_per_step_rad);
      T_odom_base = SE2(T_odom_base.translation() + shift_per_step_m, T_odom_base.angle());
    }
    PlanarScan scan = planar_scan_of_world(world, path[i], laser, rng);
    scan.stamp = Time::from_seconds(10 + static_cast<double>(i));
    result.keyframes.push_back({scan, T_odom_base, Vec3(1e-4, 1e-4, 2e-5).asDiagonal()});
  }
  return result;
}

ScanGraph2D closed_graph(const TestDrive& run) {
  ScanGraph2D graph;
  for (const GraphKeyframe2D& keyframe : run.keyframes)
    if (graph.add_keyframe(keyframe).corrects_much()) graph.optimise();
  graph.optimise();
  return graph;
}

std::vector<SE2> two_rounds() {
  std::vector<SE2> path;
  for (double at_m = 0; at_m < 1.6 * kOfficeLoop_m; at_m += 0.5) path.push_back(office_loop(at_m));
  return path;
}

}  // namespace hm::laser_testing
