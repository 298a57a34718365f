// Where is the camera? RGB-D odometry, frame by frame.
#include <cstdio>

#include "hm/io/pose/trajectory_file.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/odometry/make_odometry.hpp"

int main(int argc, char** argv) {
  const auto recording = hm::open_recording(argc > 1 ? argv[1] : "recording");
  if (!recording) {
    std::printf("%s\n", hm::to_string(recording.error()).c_str());
    return 1;
  }
  hm::OdometryParams params;
  params.max_depth_m = 4.0;
  const auto odometry = hm::make_visual_odometry(params, (*recording)->camera());  // begins at the identity

  hm::Trajectory trajectory;
  const std::size_t count = (*recording)->info().frame_count;
  for (std::size_t i = 0; i < count; ++i) {
    const auto frame = (*recording)->read(i);
    if (!frame) continue;
    const hm::TrackedFrame tracked = odometry->track(*frame);
    if (!tracked.T_odom_camera) {  // never an identity pose instead of an answer
      std::printf("frame %zu: no pose: %s\n", i, tracked.reason.c_str());
      continue;
    }
    trajectory.push_back({frame->stamp, *tracked.T_odom_camera});
    const hm::Vec3& at = tracked.T_odom_camera->translation();
    if (i % 10 == 0)
      std::printf("frame %2zu: at (%+.3f %+.3f %+.3f) m, %d of %d matches agree\n", i, at.x(), at.y(), at.z(),
                  tracked.numbers.inliers, tracked.numbers.matches);
  }
  if (!hm::write_tum_trajectory("odometry.tum", trajectory)) return 1;
  std::printf("odometry.tum: %zu of %zu frames have a pose, %.2f m of path, %.1f MB of model\n",
              trajectory.size(), count, hm::path_length(trajectory),
              static_cast<double>(odometry->memory_bytes()) * 1e-6);
  return trajectory.size() * 10 >= count * 9 ? 0 : 1;
}
