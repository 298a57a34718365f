#pragma once
#include "hm/calibration/board.hpp"
#include "hm/calibration/depth_average.hpp"
#include "hm/depth_camera/rgbd_calibration.hpp"
#include "hm/geometry/camera.hpp"

namespace hm {

/// A pixel of the rectified depth camera that looks at the board: what it reads, and what the board's pose
/// says.
struct DepthSample {
  std::int16_t x = 0, y = 0;
  float measured_m = 0, true_m = 0;
  float sigma_m = 0;  ///< expected deviation of `measured_m`
};

/// Depths of one pose of the board: readings against the plane that the colour camera saw.
struct DepthView {
  std::string name;
  double distance_m = 0;  ///< mean of the true depths
  int images = 0;         ///< that were averaged
  std::vector<DepthSample> samples;
};

/// What a view is made from.
struct DepthViewInput {
  const DepthAverage& average;  ///< of rectified depth images
  const PinholeCamera& camera;  ///< of them, without distortion
  const SE3& T_depth_board;     ///< by the colour camera and the motion between the cameras
  const BoardParams& board;
};

/// Plane of the board met by the ray of every pixel within the board's outer corners, moved outwards by 0.6
/// of a cell's diagonal (dissertation 3.1.2). Pixels without a reading, and readings farther than `gate_m`
/// from the plane (something in front of the board), give no sample; the latter are counted.
struct DepthViewResult {
  DepthView view;
  std::size_t no_reading = 0, off_plane = 0;
};
DepthViewResult compare_with_board(const DepthViewInput& input, double gate_m);

/// Distance along z at which the ray of a pixel meets the board's plane; 0 when it does not in front of the
/// camera.
double plane_depth_m(const PinholeCamera& camera, const SE3& T_camera_board, const Vec2& pixel);

}  // namespace hm
