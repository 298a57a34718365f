#pragma once
#include <cstdint>
#include <memory>

#include "hm/core/result.hpp"
#include "hm/depth_camera/rgbd_calibration.hpp"
#include "hm/geometry/image.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Applies a calibration to raw images: converts disparity to depth, rectifies depth and colour, corrects the
/// depth, registers it to the colour camera, in that order, skipping steps that the calibration does not
/// define (dissertation 3.1). Used by every reader. Const members are thread-safe.
class FrameCalibration {
 public:
  /// Prepares images of this size in pixels; cameras of another size are scaled. Error when that is not
  /// possible.
  static Result<FrameCalibration> make(const RgbdCalibration& calibration, int width, int height);
  FrameCalibration(FrameCalibration&&) noexcept;
  FrameCalibration& operator=(FrameCalibration&&) noexcept;
  ~FrameCalibration();

  /// Camera of the calibrated images, without distortion.
  [[nodiscard]] const PinholeCamera& camera() const;
  /// Calibrates an image of the size given to make(). Pass by std::move to avoid a copy.
  [[nodiscard]] DepthImage calibrate(DepthImage raw) const;
  [[nodiscard]] Image<Rgb8> calibrate(Image<Rgb8> raw) const;

 private:
  struct Impl;
  explicit FrameCalibration(std::unique_ptr<const Impl> impl);
  std::unique_ptr<const Impl> impl_;
};

}  // namespace hm
