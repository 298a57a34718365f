#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/calibration/board.hpp"
#include "hm/geometry/camera.hpp"

namespace hm {

/// A corner of a view: where it was seen, and by how much it is off the fitted camera (seen minus projected).
struct CornerResidual {
  Vec2 pixel = Vec2::Zero();
  Vec2 error_px = Vec2::Zero();
};

/// Of every corner of a view, in its order.
std::vector<CornerResidual> corner_residuals(const BoardView& view, const BoardParams& board,
                                             const PinholeCamera& camera, const SE3& T_camera_board);
/// 0 without corners.
double rms_px(std::span<const CornerResidual> corners);

/// One view of the board under a fitted camera.
struct ViewFit {
  SE3 T_camera_board;
  double rms_px = 0;
  double tilt_rad = 0;      ///< between the board's normal and the line of sight to its middle
  double distance_m = 0;    ///< of its middle
  bool is_outlier = false;  ///< left out of the fit: its error is far above the others'
  std::vector<CornerResidual> corners;
};

/// Names of what is fitted, in the order of CameraFit::sigma.
inline constexpr std::array<std::string_view, 9> kCameraFitNames{"fx", "fy", "cx", "cy", "k1",
                                                                 "k2", "p1", "p2", "k3"};

/// Intrinsics with their quality.
struct CameraFit {
  PinholeCamera camera;
  double rms_px = 0;                  ///< over the corners of all views that were used
  std::array<double, 9> sigma;        ///< standard deviations of fx, fy, cx, cy (px), k1, k2, p1, p2, k3
  std::vector<ViewFit> views;         ///< as given
  double covered_ratio = 0;           ///< cells of a grid of 12 x 9 over the image with a corner
  std::vector<std::string> warnings;  ///< what makes the set poor, in words
};

struct CameraFitParams {
  bool fit_k3 = true;
  bool fit_tangential = true;
  double outlier_ratio = 4.0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"fit_k3", {}, "fit the sixth-power term of the lens distortion too"}, self.fit_k3);
    v(ParamDoc{"fit_tangential", {}, "fit the tangential terms of the lens distortion too"},
      self.fit_tangential);
    v(ParamDoc{"outlier_ratio", {1.5, 1000}, "leave a picture out whose error is so many times the median"},
      self.outlier_ratio);
  }
};

/// Plumb-bob intrinsics from views of a board (Zhang 2000, OpenCV). Errors: fewer than three views, or views
/// that leave the camera undetermined.
Result<CameraFit> fit_camera(std::span<const BoardView> views, const BoardParams& board, int width,
                             int height, const CameraFitParams& params = {});

/// The pose of a board seen by a known camera, refined on the reprojection error; nothing when the corners do
/// not determine one.
std::optional<SE3> board_pose(const BoardView& view, const BoardParams& board, const PinholeCamera& camera);

}  // namespace hm
