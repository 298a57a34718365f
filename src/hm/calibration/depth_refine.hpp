#pragma once
#include <span>

#include "hm/calibration/depth_fit.hpp"

namespace hm {

/// One pose of the board: its corners in the colour picture, and depth against it.
struct DepthPose {
  BoardView view;
  SE3 T_color_board;
  DepthView depth;
};

/// The two cameras and the motion between them.
struct DepthGeometry {
  PinholeCamera depth_camera, color_camera;
  SE3 T_color_depth;
};

struct DepthRefinement {
  DepthGeometry geometry;
  double corners_before = 0, corners_after = 0;  ///< RMS by their expected deviation
  double depth_before = 0, depth_after = 0;      ///< the same of the board's depth; before: with `model`
};

/// Bundle adjustment over intrinsics (without distortion), the motion between the cameras, the boards' poses
/// and the coefficients of a spline correction, on corners and on depth against the boards' planes (Ceres,
/// Huber). `model` is where the coefficients begin; fit the correction anew to readings of the geometry that
/// comes out. Errors: the model is no spline, or the adjustment fails.
Result<DepthRefinement> refine_geometry(std::span<const DepthPose> poses, const BoardParams& board,
                                        const DepthGeometry& start, const DepthCorrectionModel& model,
                                        const DepthFitParams& params = {});

}  // namespace hm
