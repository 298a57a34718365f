#pragma once
#include "hm/calibration/board.hpp"
#include "hm/calibration/depth_average.hpp"
#include "hm/depth_camera/rgbd_calibration.hpp"
#include "hm/geometry/camera.hpp"

namespace hm {

/// Pixel of the rectified depth camera on the board: measured depth, and true depth from the board's pose.
struct DepthSample {
  std::int16_t x = 0, y = 0;
  float measured_m = 0, true_m = 0;
  float sigma_m = 0;  ///< expected standard deviation of `measured_m`
};

/// Depth readings of one board pose, compared with the board plane observed by the colour camera.
struct DepthView {
  std::string name;
  double distance_m = 0;  ///< mean of the true depths
  int images = 0;         ///< number of averaged images
  std::vector<DepthSample> samples;
};

/// Input of compare_with_board().
struct DepthViewInput {
  const DepthAverage& average;  ///< of rectified depth images
  const PinholeCamera& camera;  ///< of these images, without distortion
  const SE3& T_depth_board;     ///< from the colour camera and the extrinsics
  const BoardParams& board;
};

/// Result of compare_with_board(): the view, and counts of pixels without a sample.
struct DepthViewResult {
  DepthView view;
  std::size_t no_reading = 0, off_plane = 0;
};

/// Compares the readings with the board's plane at every pixel inside the board's outer corners, extended by
/// 0.6 of a cell's diagonal (dissertation 3.1.2). Pixels without a reading, and readings farther than
/// `gate_m` from the plane (occluders), give no sample and are counted.
DepthViewResult compare_with_board(const DepthViewInput& input, double gate_m);

/// Distance along z at which the ray of a pixel meets the board's plane; 0 when it does not in front of the
/// camera.
double plane_depth_m(const PinholeCamera& camera, const SE3& T_camera_board, const Vec2& pixel);

}  // namespace hm
