#pragma once
#include <memory>

#include "hm/geometry/camera.hpp"
#include "hm/odometry/feature/feature.hpp"
#include "hm/odometry/feature/feature_params.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Brightness, 8 bits (ITU-R BT.601 weights).
Image<std::uint8_t> to_gray(const Image<Rgb8>& color);

/// The variance of the image's Laplacian (4-neighbours, every second row): low for blur, darkness and blank
/// walls. 0 for an image without an inner pixel.
double sharpness(const Image<std::uint8_t>& gray);

/// The share of pixels with a reading (every second row), 0 to 1; 0 for an empty image.
double depth_coverage(const DepthImage& depth);

/// What a depth must satisfy to be used for a feature.
struct DepthGate {
  double max_depth_m = 5.5;
  double max_sigma_m = 0.05;
};

/// Finds corners, describes them and places them in space (dissertation 3.2.1). Keeps its buffers from frame
/// to frame; the result depends on the arguments alone and on nothing that came before. One thread calls it.
class FeatureDetector {
 public:
  /// The camera must be free of lens distortion.
  FeatureDetector(const FeatureParams& params, const PinholeCamera& camera, const DepthGate& gate);
  ~FeatureDetector();
  FeatureDetector(FeatureDetector&&) noexcept;
  FeatureDetector& operator=(FeatureDetector&&) noexcept;

  /// The features of a frame, strongest cells first, each with descriptor and orientation; `has_depth` marks
  /// those that have a place. `depth` may be empty or must be of the image's size. Fewer than asked for,
  /// or none, where the image has no corners. Images of less than 64 pixels in a direction have none.
  [[nodiscard]] FeatureSet detect(const Image<std::uint8_t>& gray, const DepthImage& depth);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Fills the place and covariance of a feature from the depth around its pixel, if it passes the gate.
void place_in_space(Feature& feature, const DepthImage& depth, const PinholeCamera& camera,
                    const FeatureParams& params, const DepthGate& gate);

}  // namespace hm
