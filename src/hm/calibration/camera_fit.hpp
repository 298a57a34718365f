#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/calibration/board.hpp"
#include "hm/geometry/camera.hpp"

namespace hm {

/// Observed corner and its reprojection error (observed minus projected).
struct CornerResidual {
  Vec2 pixel = Vec2::Zero();
  Vec2 error_px = Vec2::Zero();
};

/// Reprojection errors of all corners of a view, in its order.
std::vector<CornerResidual> corner_residuals(const BoardView& view, const BoardParams& board,
                                             const PinholeCamera& camera, const SE3& T_camera_board);
/// Root mean square reprojection error; 0 without corners.
double rms_px(std::span<const CornerResidual> corners);

/// One view of the board with a fitted camera.
struct ViewFit {
  SE3 T_camera_board;
  double rms_px = 0;
  double tilt_rad = 0;      ///< between the board's normal and the ray to its centre
  double distance_m = 0;    ///< of the board's centre
  bool is_outlier = false;  ///< excluded from the fit because of its large error
  std::vector<CornerResidual> corners;
};

/// Names of the fitted parameters, in the order of CameraFit::sigma.
inline constexpr std::array<std::string_view, 9> kCameraFitNames{"fx", "fy", "cx", "cy", "k1",
                                                                 "k2", "p1", "p2", "k3"};

/// Fitted intrinsics with quality measures.
struct CameraFit {
  PinholeCamera camera;
  double rms_px = 0;                  ///< over the corners of all inlier views
  std::array<double, 9> sigma;        ///< standard deviations of fx, fy, cx, cy (px), k1, k2, p1, p2, k3
  std::vector<ViewFit> views;         ///< in the order of the input
  double covered_ratio = 0;           ///< share of cells with a corner, of a 12 x 9 grid over the image
  std::vector<std::string> warnings;  ///< weaknesses of the image set
};

struct CameraFitParams {
  bool fit_k3 = true;
  bool fit_tangential = true;
  /// Exclude images whose error exceeds this multiple of the median; smaller excludes more.
  double outlier_ratio = 4.0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"fit_k3", {}, "fit the sixth-order radial distortion coefficient k3"}, self.fit_k3);
    v(ParamDoc{"fit_tangential", {}, "fit the tangential distortion coefficients p1, p2"},
      self.fit_tangential);
  }
};

/// Plumb-bob intrinsics from views of a board (Zhang 2000, OpenCV). Errors: fewer than three views, or views
/// that leave the camera undetermined.
Result<CameraFit> fit_camera(std::span<const BoardView> views, const BoardParams& board, int width,
                             int height, const CameraFitParams& params = {});

/// Board pose T_camera_board for a known camera, minimising the reprojection error; nothing when the corners
/// do not determine it.
std::optional<SE3> board_pose(const BoardView& view, const BoardParams& board, const PinholeCamera& camera);

}  // namespace hm
