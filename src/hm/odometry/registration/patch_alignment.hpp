#pragma once
#include <optional>

#include "hm/geometry/camera.hpp"
#include "hm/odometry/feature/image_pyramid.hpp"

namespace hm {

using Mat2 = Eigen::Matrix2d;

/// Patch to search for: the neighbourhood of a pixel in an earlier image, on the plane through its point.
struct PatchSource {
  const ImagePyramid* pyramid = nullptr;
  Vec2 pixel = Vec2::Zero();
  Mat2 ref_from_cur = Mat2::Identity();  ///< d (pixel in the earlier image) / d (pixel in the new one)
};

struct PatchMatch {
  Vec2 pixel = Vec2::Zero();
  Mat2 information = Mat2::Zero();  ///< of the pixel, from the gradients and the residual noise; px^-2
  double correlation = 0;           ///< normalised, -1 to 1
};

/// Affine warp between two views of a small plane: the 2x2 matrix d (pixel in ref) / d (pixel in cur) at the
/// point. Nothing when the plane is seen edge-on or from behind in one of them.
std::optional<Mat2> plane_warp(const PinholeCamera& camera, const SE3& T_ref_cur, const Vec3& p_cur,
                               const Vec3& normal_cur);

/// Parameters of align_patch(): coarsest and finest pyramid level, limit of the shift from the guess, least
/// correlation.
struct PatchSearch {
  int first_level = 1;
  int last_level = 0;  ///< above 0 for blurred images, whose finest levels show nothing
  double max_shift_px = 10;
  double min_correlation = 0.8;
};

/// Finds a patch of an earlier image in a new one with subpixel accuracy: inverse compositional alignment of
/// a warped patch with gain and offset of brightness (Baker and Matthews 2004), from level `first_level` to
/// `last_level`. Nothing when it leaves the image, moves farther than `max_shift_px` from the guess, does not
/// converge or correlates less than `min_correlation`.
std::optional<PatchMatch> align_patch(const PatchSource& source, const ImagePyramid& current,
                                      const Vec2& guess, const PatchSearch& search);

}  // namespace hm
