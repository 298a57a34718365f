#pragma once
#include <span>

#include "hm/calibration/camera_fit.hpp"
#include "hm/depth_camera/depth_correction.hpp"
#include "hm/geometry/image.hpp"

namespace hm {

/// Corners with the errors that are left, drawn as lines `scale` times as long, coloured by length.
Image<Rgb8> draw_error_vectors(std::span<const CornerResidual> corners, int width, int height);

/// Draws the number of corners in each cell of the image, and the corners.
Image<Rgb8> draw_coverage(std::span<const CornerResidual> corners, int width, int height);

/// Draws what a correction adds at a distance, over the image; `full_m` is the end of the colour scale.
Image<Rgb8> draw_correction(const DepthCorrectionModel& model, double depth_m, double full_m);
/// The largest correction of a model over image and trained range, metres.
double largest_correction_m(const DepthCorrectionModel& model);

}  // namespace hm
