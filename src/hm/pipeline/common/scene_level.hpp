#pragma once
#include <memory>
#include <span>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/level/scene_up.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/report/summary_tree.hpp"
#include "hm/sensors/imu.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Evidence for the up direction besides the surface of a scene.
struct UpClues {
  PinholeCamera camera;                   ///< with fy < 0 its y axis points up
  std::shared_ptr<const CarriedImu> imu;  ///< null: none
};

/// Up in the world of the poses: by gravity along the path, refined by level and vertical surfaces near it;
/// else by surfaces and how the camera was held; else unknown, with the cameras' mean upward direction.
UpDirection find_up(std::span<const SurfacePatch> patches, const Trajectory& T_world_camera,
                    const UpClues& clues);
/// The same for a mesh; the frame's own axis where it is within kAxisTolerance_rad of what was found.
UpDirection up_of_frame(const TriangleMesh& mesh, const Trajectory& T_world_camera, const UpClues& clues);

/// Planes fitted to the windows of a depth image of 24 x 24 pixels that are flat, in the world of the pose.
std::vector<SurfacePatch> patches_of(const PosedFrame& posed, const PinholeCamera& camera);

/// Pose at the origin of a level frame of a camera that begins there: by its first image and the
/// accelerometer about its moment, else level as it is held.
SE3 level_start(const RgbdFrame& first, const UpClues& clues);

/// known, direction [x, y, z], axis, source, sigma_deg as an object; the direction is null while unknown.
void visit(const UpDirection& up, SummaryTree& v);

}  // namespace hm
