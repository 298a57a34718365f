#pragma once
#include <memory>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/odometry/feature/keyframe.hpp"
#include "hm/odometry/registration/surface_grid.hpp"

namespace hm::test {

/// Points with descriptors, observed by simulated keyframes with a Kinect's noise: one pixel, sigma_z =
/// 0.0014 z^2, one wrong bit in twelve.
struct LandmarkWorld {
  struct Point {
    Vec3 p_world;
    BinaryDescriptor descriptor;
  };
  std::vector<Point> points;
};

PinholeCamera landmark_camera();
BinaryDescriptor random_descriptor(Rng& rng);
/// Inverts each bit with this probability.
BinaryDescriptor noisy(const BinaryDescriptor& descriptor, double ratio, Rng& rng);

/// Points on the walls, floor and ceiling of a corridor open at both ends: x 0 to `length_m`, 2 m wide, 2.5 m
/// high.
LandmarkWorld corridor(double length_m, int points_per_metre, Rng& rng);
/// The same, with positions and descriptors repeated every `period_m`.
LandmarkWorld periodic_corridor(double length_m, double period_m, int points_per_metre, Rng& rng);
/// Points on the walls of a closed ring of corridors, `side_m` long at its middle.
LandmarkWorld ring(double side_m, int points_per_metre, Rng& rng);

/// Pose of a level camera at a height of 1.3 m, with optical axis at angle yaw.
SE3 level_camera(double x_m, double y_m, double yaw_rad);

struct SeenOptions {
  double pixel_sigma_px = 0.7;
  double depth_sigma_per_m = 0.0014;
  double wrong_bits_ratio = 0.08;
  double max_depth_m = 4.5;
  std::size_t max_features = 400;
};
/// Features observed from a pose, without occlusion.
FeatureSet see(const LandmarkWorld& world, const SE3& T_world_camera, Rng& rng,
               const SeenOptions& options = {});

/// Of a depth camera whose readings are wrong: 1 / depth = scale / reading + offset_1_m.
struct ReadingError {
  double scale = 1, offset_1_m = 0;
};
/// Depth image of a box-shaped room from inside, by landmark_camera() with a Kinect's noise.
DepthImage depth_in_room(const Vec3& half_size_m, const SE3& T_world_depth, Rng& rng,
                         const ReadingError& error = {});

/// One keyframe per pose of a path; `T_odom_camera` drifts in yaw by `drift_rad_m` per metre.
struct KeyframesOfWay {
  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  std::vector<SE3> truth;
};
KeyframesOfWay walk(const LandmarkWorld& world, const std::vector<SE3>& way, double drift_rad_m, Rng& rng);

/// Path around a ring of corridors: `rounds` rounds, a pose every `step_m`.
std::vector<SE3> way_around(double side_m, double step_m, double rounds);

}  // namespace hm::test
