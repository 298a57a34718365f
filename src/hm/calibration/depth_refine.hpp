#pragma once
#include <span>

#include "hm/calibration/depth_fit.hpp"

namespace hm {

/// One board pose: its corners in the colour image, and depth readings on the board.
struct DepthPose {
  BoardView view;
  SE3 T_color_board;
  DepthView depth;
};

/// Intrinsics of both cameras and their extrinsics.
struct DepthGeometry {
  PinholeCamera depth_camera, color_camera;
  SE3 T_color_depth;
};

struct DepthRefinement {
  DepthGeometry geometry;
  double corners_before = 0, corners_after = 0;  ///< RMS in units of the expected deviation
  double depth_before = 0, depth_after = 0;      ///< the same for depth on the board; before: with `model`
};

/// Bundle adjustment of intrinsics (without distortion), extrinsics, board poses and the coefficients of a
/// spline correction, using corner and depth residuals (Ceres, Huber loss). `model` gives the initial
/// coefficients; afterwards, refit the correction with the refined geometry. Errors: the model is not a
/// spline, or the adjustment fails.
Result<DepthRefinement> refine_geometry(std::span<const DepthPose> poses, const BoardParams& board,
                                        const DepthGeometry& start, const DepthCorrectionModel& model,
                                        const DepthFitParams& params = {});

}  // namespace hm
