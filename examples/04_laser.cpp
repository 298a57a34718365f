// How do the scans of a laser become poses and a map of occupied and free space?
#include <cstdio>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/map/occupancy_grid_file.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/pipeline/laser/laser_mapper.hpp"

int main(int argc, char** argv) {
  // Scans come from your laser; here from a ROS bag, CARMEN log ...
  const auto recording = hm::open_laser_recording(argc > 1 ? argv[1] : "flight");
  if (!recording) {
    std::printf("%s\n", hm::to_string(recording.error()).c_str());
    return 1;
  }
  hm::LaserPlatform platform;
  platform.rigs = {recording->rig.value_or(hm::LaserRig{})};  // where the laser and its mirrors sit
  platform.has_imu = !recording->imu.empty();
  auto mapper = hm::LaserMapper::create(platform, {"mvog.resolution_m=0.1"});
  if (!mapper) {
    std::printf("%s\n", hm::to_string(mapper.error()).c_str());
    return 1;
  }
  std::size_t imu = 0, posed = 0;
  const auto& scans = recording->lasers.front().scans;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    for (; imu < recording->imu.size() && recording->imu[imu].stamp <= scans[i].stamp_of(scans[i].size());
         ++imu)
      mapper->add_imu(recording->imu[imu]);
    mapper->add_scan(scans[i]);
    for (const hm::LaserPose& pose : mapper->take_poses()) {
      if (!pose.T_map_base) {
        std::printf("scan at %.2f s: no pose: %s\n", pose.stamp.seconds(), pose.reason.c_str());
        continue;
      }
      if (posed++ % 60 != 0) continue;
      const hm::Vec3& at = pose.T_map_base->translation();
      std::printf("%6.2f s: at (%+.2f %+.2f) m, height %.2f m, %.2f m/s\n", pose.stamp.seconds(), at.x(),
                  at.y(), pose.height_m.value_or(0), pose.velocity_base.head<2>().norm());
    }
  }
  mapper->finish();
  const hm::Trajectory trajectory = mapper->trajectory();
  const hm::MultiVolumeGrid map = mapper->corrected_map();
  const auto slice = map.slice(map.bounds().min().z(), map.bounds().max().z());
  if (!slice || !hm::write_occupancy_grid("floor.yaml", *slice)) return 1;
  if (!hm::write_tum_trajectory("laser.tum", trajectory)) return 1;
  std::printf("floor.pgm: %.0f m2 seen in %zu kB; %zu of %zu scans have a pose, %.2f m of path\n",
              map.size().area_m2, map.bytes() / 1000, trajectory.size(), scans.size(),
              hm::path_length(trajectory));
  const hm::Vec3 laser = (trajectory.back().T_world_base * platform.rigs[0].T_base_laser).translation();
  const bool free_at_the_laser = map.at(laser) == hm::Occupancy::kFree;
  return trajectory.size() * 10 >= scans.size() * 9 && free_at_the_laser ? 0 : 1;
}
