#pragma once
#include <span>
#include <string>
#include <vector>

#include "hm/calibration/camera_fit.hpp"

namespace hm {

/// A board seen by both cameras at the same moment.
struct BoardPair {
  BoardView depth_camera, color_camera;
};

/// What of a pair of cameras is fitted, besides the motion between them and the boards' poses.
enum class StereoRefine { kExtrinsics, kIntrinsicsToo };
inline constexpr std::string_view kStereoRefineNames[] = {"extrinsics", "intrinsics_too"};

struct StereoFitParams {
  StereoRefine refine = StereoRefine::kExtrinsics;
  double outlier_ratio = 4.0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"refine",
               {},
               "what is fitted: the motion between the cameras, or their focal lengths and centres too"},
      self.refine, kStereoRefineNames);
    v(ParamDoc{"outlier_ratio", {1.5, 1000}, "leave a pair out whose error is so many times the median"},
      self.outlier_ratio);
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
  PinholeCamera depth_camera, color_camera;  ///< as given, unless they were refined
  Vec3 translation_sigma_m = Vec3::Zero();
  Vec3 rotation_sigma_rad = Vec3::Zero();
  double rms_px = 0;
  std::vector<PairFit> pairs;
  std::vector<std::string> warnings;
};

/// The motion from depth camera to colour camera from pairs of views: bundle adjustment of the boards' poses
/// and the motion over the corners of both cameras (Ceres), robust, with fixed intrinsics unless asked
/// otherwise. A checkerboard that the two cameras numbered from different ends is turned. Errors: no pair
/// whose boards' poses can be told, or a motion that is left undetermined.
Result<StereoFit> fit_stereo(std::span<const BoardPair> pairs, const BoardParams& board,
                             const PinholeCamera& depth_camera, const PinholeCamera& color_camera,
                             const StereoFitParams& params = {});

}  // namespace hm
