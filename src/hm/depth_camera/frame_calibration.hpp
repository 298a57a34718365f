#pragma once
#include <cstdint>
#include <memory>

#include "hm/core/result.hpp"
#include "hm/depth_camera/rgbd_calibration.hpp"
#include "hm/geometry/image.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// What every reader does to its pictures: turn raw disparity into depth, rectify both, correct the depth,
/// register it to the colour camera, in that order, each as far as the calibration says something about it.
/// Const members may be used from any thread.
class FrameCalibration {
 public:
  /// For pictures of this size; cameras of another size are scaled. An error when that is not possible.
  static Result<FrameCalibration> make(const RgbdCalibration& calibration, int width, int height);
  FrameCalibration(FrameCalibration&&) noexcept;
  FrameCalibration& operator=(FrameCalibration&&) noexcept;
  ~FrameCalibration();

  /// The camera of the pictures given back, without distortion.
  [[nodiscard]] const PinholeCamera& camera() const;
  /// Of the size that it was made for. Moved into it, a picture is not copied.
  [[nodiscard]] DepthImage calibrate(DepthImage raw) const;
  [[nodiscard]] Image<Rgb8> calibrate(Image<Rgb8> raw) const;

 private:
  struct Impl;
  explicit FrameCalibration(std::unique_ptr<const Impl> impl);
  std::unique_ptr<const Impl> impl_;
};

}  // namespace hm
