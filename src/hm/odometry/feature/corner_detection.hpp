#pragma once
#include <span>
#include <vector>

#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/odometry/feature/feature_params.hpp"

namespace hm {

/// A corner of one image: subpixel place and Shi-Tomasi score (smaller eigenvalue of the gradients' second
/// moments, mean over the window).
struct Corner {
  Vec2 pixel = Vec2::Zero();
  float score = 0;
};

/// Corners keep this far from the image's border, so that their descriptor's patch is inside.
inline constexpr int kCornerBorder_px = 16;

/// FAST-9 corners (Rosten and Drummond 2006) ranked by the score of Shi and Tomasi 1994, taken cell by cell
/// so that they cover the image: the best of every cell, then the second best and so on until `wanted` are
/// found. Refined by a few steps of Foerstner and Guelch 1987. The result is in the order of taking, and does
/// not depend on anything but the arguments.
std::vector<Corner> grid_corners(const Image<std::uint8_t>& gray, int wanted, const FeatureParams& params);

/// Shi and Tomasi's good features over the whole image, where `mask` is not zero (none: everywhere), by
/// decreasing score, as the dissertation had them (`quality_ratio` 0.01, 400 corners, 1 px apart).
std::vector<Corner> shi_tomasi_corners(const Image<std::uint8_t>& gray, const Image<std::uint8_t>& mask,
                                       int wanted, const FeatureParams& params);

}  // namespace hm
