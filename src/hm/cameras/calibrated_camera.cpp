#include "hm/cameras/calibrated_camera.hpp"

#include <utility>

#include "hm/depth_camera/frame_calibration.hpp"

namespace hm {
namespace {

class CalibratedCamera : public CameraDriver {
 public:
  CalibratedCamera(std::unique_ptr<CameraDriver> camera, FrameCalibration calibration)
      : camera_(std::move(camera)), calibration_(std::move(calibration)), raw_(camera_->describe().camera) {}

  [[nodiscard]] CameraDescription describe() const override {
    CameraDescription description = camera_->describe();
    description.camera = calibration_.camera();
    description.intrinsics_source = "calibration";
    return description;
  }

  /// An image of a wrong size is passed on as it is: whoever takes it counts it.
  CameraEvent next(std::chrono::milliseconds timeout) override {
    CameraEvent event = camera_->next(timeout);
    RgbdFrame& frame = event.frame;
    if (event.kind != CameraEvent::Kind::kFrame || !fits(frame.depth.units)) return event;
    frame.depth = calibration_.calibrate(std::move(frame.depth));
    if (fits(frame.color)) frame.color = calibration_.calibrate(std::move(frame.color));
    return event;
  }

 private:
  template <class Pixel>
  [[nodiscard]] bool fits(const Image<Pixel>& image) const {
    return image.width() == raw_.width && image.height() == raw_.height;
  }

  std::unique_ptr<CameraDriver> camera_;
  FrameCalibration calibration_;
  PinholeCamera raw_;
};

}  // namespace

Result<std::unique_ptr<CameraDriver>> calibrate_camera(std::unique_ptr<CameraDriver> camera,
                                                       const RgbdCalibration& calibration) {
  const PinholeCamera raw = camera->describe().camera;
  auto prepared = FrameCalibration::make(calibration, raw.width, raw.height);
  if (!prepared) return forward_error(prepared);
  return std::make_unique<CalibratedCamera>(std::move(camera), std::move(*prepared));
}

}  // namespace hm
