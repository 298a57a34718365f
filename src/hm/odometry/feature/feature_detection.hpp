#pragma once
#include <memory>

#include "hm/geometry/camera.hpp"
#include "hm/odometry/feature/feature.hpp"
#include "hm/odometry/feature/feature_params.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Converts to 8-bit brightness (ITU-R BT.601 weights).
Image<std::uint8_t> to_gray(const Image<Rgb8>& color);

/// Variance of the image's Laplacian (4-neighbours, every second row): low for blur, darkness and blank
/// walls. 0 for an image without inner pixels.
double sharpness(const Image<std::uint8_t>& gray);

/// Share of pixels with a reading (every second row), 0 to 1; 0 for an empty image.
double depth_coverage(const DepthImage& depth);

/// Limits on a depth to be used for a feature.
struct DepthGate {
  double max_depth_m = 5.5;
  double max_sigma_m = 0.05;
};

/// Detects corners and computes their descriptors, 3D positions and covariances (dissertation 3.2.1). Reuses
/// its buffers from frame to frame; results do not depend on earlier frames. Not thread safe.
class FeatureDetector {
 public:
  /// The camera must have no lens distortion.
  FeatureDetector(const FeatureParams& params, const PinholeCamera& camera, const DepthGate& gate);
  ~FeatureDetector();
  FeatureDetector(FeatureDetector&&) noexcept;
  FeatureDetector& operator=(FeatureDetector&&) noexcept;

  /// Detects the features of a frame, strongest of each cell first, with descriptor and orientation;
  /// then, where these are few, those that only images of half and quarter size show above the noise;
  /// `has_depth` marks those with a 3D position. `depth` must be empty or have the image's size. May return
  /// fewer than max_features, or none; none for images smaller than 64 pixels in a direction.
  [[nodiscard]] FeatureSet detect(const Image<std::uint8_t>& gray, const DepthImage& depth);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Computes the 3D position and covariance of a feature from the depth around its pixel, if it passes the
/// gate.
void place_in_space(Feature& feature, const DepthImage& depth, const PinholeCamera& camera,
                    const FeatureParams& params, const DepthGate& gate);

}  // namespace hm
