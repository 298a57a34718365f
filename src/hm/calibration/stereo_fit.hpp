#pragma once
#include <span>
#include <string>
#include <vector>

#include "hm/calibration/camera_fit.hpp"

namespace hm {

/// Board observed by both cameras at the same time.
struct BoardPair {
  BoardView depth_camera, color_camera;
};

/// Parameters fitted besides the board poses.
enum class StereoRefine { kExtrinsics, kIntrinsicsToo };
inline constexpr std::string_view kStereoRefineNames[] = {"extrinsics", "intrinsics_too"};

struct StereoFitParams {
  StereoRefine refine = StereoRefine::kExtrinsics;
  /// Exclude pairs whose error exceeds this multiple of the median; smaller excludes more.
  double outlier_ratio = 4.0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"refine",
               {},
               "parameters to fit: the transform between the cameras, or focal lengths and principal points "
               "too"},
      self.refine, kStereoRefineNames);
  }
};

struct PairFit {
  double depth_rms_px = 0, color_rms_px = 0;
  bool is_outlier = false;
  SE3 T_color_board;
  std::vector<CornerResidual> depth_corners, color_corners;
};

struct StereoFit {
  SE3 T_color_depth;
  PinholeCamera depth_camera, color_camera;  ///< as given, unless refined
  Vec3 translation_sigma_m = Vec3::Zero();
  Vec3 rotation_sigma_rad = Vec3::Zero();
  double rms_px = 0;
  std::vector<PairFit> pairs;
  std::vector<std::string> warnings;
};

/// Fits T_color_depth to pairs of views: robust bundle adjustment of board poses and extrinsics over the
/// corners of both cameras (Ceres; Huber loss), with fixed intrinsics unless refined. A checkerboard that was
/// numbered from different ends is renumbered. Errors: no pair with a determined board pose, or an
/// undetermined problem.
Result<StereoFit> fit_stereo(std::span<const BoardPair> pairs, const BoardParams& board,
                             const PinholeCamera& depth_camera, const PinholeCamera& color_camera,
                             const StereoFitParams& params = {});

}  // namespace hm
