#include "hm/pipeline/experiments/laser/grid_scans.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/sim/recording/simulation.hpp"

namespace hm {
namespace {

/// A scan of a vertical laser at `pose` whose beams fan out from straight down, over the side `left`, to
/// straight up.
GridScan vertical_scan(const Renderer& renderer, const SE3& pose, const Vec3& left, Rng& rng) {
  constexpr int kBeams = 181;
  constexpr double kReach_m = 20, kSigma_m = 0.01;
  std::vector<Ray> rays(kBeams);
  std::vector<RayHit> hits(kBeams);
  for (int beam = 0; beam < kBeams; ++beam) {
    const double angle = std::numbers::pi * (beam / (kBeams - 1.0) - 0.5);
    rays[static_cast<std::size_t>(beam)] = {pose.translation(),
                                            std::cos(angle) * left + std::sin(angle) * Vec3::UnitZ(), 0};
  }
  renderer.cast(rays, hits);
  GridScan scan{pose.translation(), {}};
  for (std::size_t beam = 0; beam < rays.size(); ++beam) {
    if (!hits[beam].is_hit() || hits[beam].range_m > kReach_m) continue;
    const double range_m = hits[beam].range_m + rng.normal(0, kSigma_m);
    scan.p_world_points.push_back((pose.translation() + range_m * rays[beam].direction_world).cast<float>());
  }
  return scan;
}

}  // namespace

std::size_t GridScans::beams() const {
  std::size_t count = 0;
  for (const GridScan& scan : scans) count += scan.p_world_points.size();
  return count;
}

Result<GridScans> recorded_grid_scans(const std::filesystem::path& path, std::size_t most) {
  const auto recording = open_laser_recording(path);
  if (!recording) return forward_error(recording);
  std::vector<std::pair<Time, GridScan>> stamped;
  const Duration gap = Duration::from_seconds(0.2);
  for (const LaserStream& laser : recording->lasers)
    for (const LaserScan& scan : laser.scans) {
      const auto T_world_base = pose_at(recording->odometry, scan.stamp, gap, gap);
      if (!T_world_base) continue;
      const SE3 T_world_laser = *T_world_base * laser.T_base_laser;
      GridScan placed{T_world_laser.translation(), {}};
      for (std::size_t beam = 0; beam < scan.size(); ++beam) {
        if (!scan.is_return(beam)) continue;
        const double angle = scan.angle_rad(beam), range = static_cast<double>(scan.ranges_m[beam]);
        placed.p_world_points.push_back(
            (T_world_laser * Vec3(range * std::cos(angle), range * std::sin(angle), 0)).cast<float>());
      }
      stamped.emplace_back(scan.stamp, std::move(placed));
    }
  if (stamped.empty())
    return fail(ErrorCode::kInvalidValue, path.string(), "no scan has a pose of the odometry");
  std::ranges::stable_sort(stamped, {}, &std::pair<Time, GridScan>::first);
  GridScans result{fmt::format("recording {}", path.filename().string()), {}};
  for (auto& [stamp, scan] : stamped)
    if (result.scans.size() < most) result.scans.push_back(std::move(scan));
  return result;
}

GridScans simulated_grid_scans(WorldKind world, std::size_t most, std::uint64_t seed) {
  SimulationParams params;
  params.world = world;
  params.sensor = SensorPreset::kKinect;  // only for its rate
  params.seed = static_cast<int>(seed);
  const Simulation simulation(params);
  const Renderer renderer(simulation.world());
  Rng rng(seed, 5);
  GridScans result{
      fmt::format("simulated vertical lasers in the {}", kWorldKindNames[static_cast<int>(world)]), {}};
  const std::size_t poses = std::min(simulation.frame_count(), std::max<std::size_t>(1, most / 2));
  const std::size_t step = simulation.frame_count() / poses;
  for (std::size_t i = 0; i < poses; ++i) {
    const SE3 pose = simulation.true_pose(i * step);
    Vec3 left = -pose.rotation().col(0);  // the camera's x axis points to the right
    left.z() = 0;
    left.normalize();
    result.scans.push_back(vertical_scan(renderer, pose, left, rng));
    result.scans.push_back(vertical_scan(renderer, pose, -left, rng));
  }
  return result;
}

}  // namespace hm
