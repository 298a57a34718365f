#pragma once
#include <vector>

#include "hm/calibration/board.hpp"
#include "hm/calibration/depth_reference.hpp"
#include "hm/core/rng.hpp"
#include "hm/geometry/camera.hpp"

/// Synthetic board views for tests: exact corner positions for a known camera and board pose.
namespace hm::testing_calibration {

inline const PinholeCamera kDepthCamera{
    640, 480, 578.853, 574.608, 316.004, 246.041, {-0.02542, 0.000217, -0.000929, 0.000197, 0}};
inline const PinholeCamera kColorCamera{
    640, 480, 537.674, 534.380, 321.226, 249.774, {0.03960, -0.11131, 0.00212, 0.000709, 0}};
inline const SE3 kT_color_depth(so3_exp(Vec3(0.003, 0.009, 0.002)), Vec3(-0.02601, -0.000053, 0.000568));

/// Random board pose (T_camera_board) at a distance: its centre near the image centre, tilted about a random
/// axis.
inline SE3 random_pose(const PinholeCamera& camera, const BoardParams& board, double distance_m, Rng& rng) {
  const Vec2 pixel(camera.width * rng.uniform(0.3, 0.7), camera.height * rng.uniform(0.3, 0.7));
  const double axis = rng.uniform(0, 6.28), tilt = rng.uniform(0.2, 0.7);
  const Mat3 R =
      so3_exp(tilt * Vec3(std::cos(axis), std::sin(axis), 0)) * so3_exp(Vec3(0, 0, rng.uniform(-0.3, 0.3)));
  const Vec3 middle = 0.5 * corner_on_board(board, board.corners_x * board.corners_y - 1);
  return {R, camera.unproject(pixel, distance_m) - R * middle};
}

/// Projects all corners with noise, including those outside the image.
inline BoardView seen_by(const PinholeCamera& camera, const BoardParams& board, const SE3& T_camera_board,
                         double sigma_px, Rng& rng) {
  BoardView view;
  for (int i = 0; i < board.corners_x * board.corners_y; ++i) {
    view.corners.push_back(i);
    view.pixels.push_back(camera.project(T_camera_board * corner_on_board(board, i)) +
                          Vec2(rng.normal(0, sigma_px), rng.normal(0, sigma_px)));
  }
  return view;
}

/// View of a board that fills the image at depth z, with readings biased by `bias_m(x, y, z)`.
template <class Bias>
DepthView whole_image(int width, int height, double z, double sigma_m, Bias&& bias_m, Rng& rng) {
  DepthView view;
  view.distance_m = z;
  view.images = 1;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      view.samples.push_back({static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                              static_cast<float>(z + bias_m(x, y, z) + rng.normal(0, sigma_m)),
                              static_cast<float>(z), static_cast<float>(sigma_m)});
  return view;
}

}  // namespace hm::testing_calibration
