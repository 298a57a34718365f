#pragma once
#include <array>
#include <span>
#include <vector>

#include "hm/calibration/board.hpp"
#include "hm/geometry/camera.hpp"

namespace hm::detail {

/// Corners of one board in one camera.
struct StereoView {
  const BoardView* view = nullptr;
  bool in_depth_camera = false;
  std::size_t board = 0;  ///< index into StereoState::T_color_board
};

/// Unknowns of the bundle adjustment of two cameras.
struct StereoState {
  SE3 T_color_depth;
  PinholeCamera depth_camera, color_camera;
  std::vector<SE3> T_color_board;
};

struct StereoSolution {
  bool converged = false;
  double rms_px = 0;
  Vec3 rotation_sigma_rad = Vec3::Zero(), translation_sigma_m = Vec3::Zero();
};

/// Minimises the reprojection error of all views over the state (Ceres; Huber loss of 1 px); focal lengths
/// and principal points only if `with_intrinsics`.
StereoSolution solve_stereo(std::span<const StereoView> views, const BoardParams& board, bool with_intrinsics,
                            StereoState& state);

}  // namespace hm::detail
