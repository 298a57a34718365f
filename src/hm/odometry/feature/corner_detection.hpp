#pragma once
#include <span>
#include <vector>

#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/odometry/feature/feature_params.hpp"

namespace hm {

/// Image corner: subpixel position and Shi-Tomasi score (smaller eigenvalue of the gradients' second moment
/// matrix, averaged over the window).
struct Corner {
  Vec2 pixel = Vec2::Zero();
  float score = 0;
};

/// Minimum distance of corners from the image border, so that the descriptor's patch lies inside.
inline constexpr int kCornerBorder_px = 16;

/// FAST-9 corners (Rosten and Drummond 2006) ranked by the score of Shi and Tomasi 1994 and selected cell by
/// cell to cover the image: the best of every cell, then the second best, until `wanted` are found; none that
/// score as noise does. Refined
/// to subpixels by a few steps of Foerstner and Guelch 1987. The result is in the order of selection and
/// depends only on the arguments.
std::vector<Corner> grid_corners(const Image<std::uint8_t>& gray, int wanted, const FeatureParams& params);

/// Shi and Tomasi's good features over the whole image where `mask` is not zero (empty mask: everywhere), by
/// decreasing score, as in the dissertation (`quality_ratio` 0.01, 400 corners, 1 px apart).
std::vector<Corner> shi_tomasi_corners(const Image<std::uint8_t>& gray, const Image<std::uint8_t>& mask,
                                       int wanted, const FeatureParams& params);

}  // namespace hm
