#include "hm/io/frame_calibration.hpp"

#include <optional>

#include "hm/io/depth_registration.hpp"
#include "hm/io/lens_map.hpp"

namespace hm {

struct FrameCalibration::Impl {
  PinholeCamera camera;
  std::optional<LensMap> depth_lens, color_lens;
  std::optional<DepthCorrection> correction;
  std::optional<DepthRegistration> registration;
};

namespace {

/// The camera at another size, if that has the same shape.
Result<PinholeCamera> fitted(const PinholeCamera& camera, const char* name, int width, int height) {
  if (camera.width == width && camera.height == height) return camera;
  if (static_cast<std::int64_t>(camera.width) * height != static_cast<std::int64_t>(camera.height) * width)
    return fail(ErrorCode::kInvalidValue, "", "the calibration's {} is {} x {}, the pictures are {} x {}",
                name, camera.width, camera.height, width, height);
  PinholeCamera scaled = camera.scaled(static_cast<double>(width) / camera.width);
  scaled.width = width;
  scaled.height = height;
  return scaled;
}

}  // namespace

FrameCalibration::FrameCalibration(std::unique_ptr<const Impl> impl) : impl_(std::move(impl)) {}
FrameCalibration::FrameCalibration(FrameCalibration&&) noexcept = default;
FrameCalibration& FrameCalibration::operator=(FrameCalibration&&) noexcept = default;
FrameCalibration::~FrameCalibration() = default;

Result<FrameCalibration> FrameCalibration::make(const RgbdCalibration& calibration, int width, int height) {
  auto impl = std::make_unique<Impl>();
  const auto& given_depth = calibration.depth_camera ? calibration.depth_camera : calibration.color_camera;
  const auto& given_color = calibration.color_camera ? calibration.color_camera : calibration.depth_camera;
  if (!given_depth) return fail(ErrorCode::kInvalidValue, "", "the calibration names no camera");
  const auto depth = fitted(*given_depth, "depth camera", width, height);
  if (!depth) return forward_error(depth);
  const auto color = fitted(*given_color, "colour camera", width, height);
  if (!color) return forward_error(color);
  if (const auto& model = calibration.depth_correction) {
    if (static_cast<std::int64_t>(model->width) * height != static_cast<std::int64_t>(model->height) * width)
      return fail(ErrorCode::kInvalidValue, "",
                  "the depth correction is for {} x {}, the pictures are {} x {}", model->width,
                  model->height, width, height);
    impl->correction.emplace(*model, width, height);
  }
  if (!depth->distortion.is_zero()) impl->depth_lens.emplace(*depth);
  if (!color->distortion.is_zero()) impl->color_lens.emplace(*color);
  impl->camera = depth->without_distortion();
  if (calibration.registers_depth()) {
    impl->registration.emplace(depth->without_distortion(), color->without_distortion(),
                               *calibration.T_color_depth);
    impl->camera = color->without_distortion();
  }
  return FrameCalibration(std::move(impl));
}

const PinholeCamera& FrameCalibration::camera() const { return impl_->camera; }

DepthImage FrameCalibration::calibrate(const DepthImage& raw) const {
  DepthImage depth = raw;
  if (impl_->depth_lens) depth.units = impl_->depth_lens->undistort(depth.units);
  if (impl_->correction) impl_->correction->apply(depth);
  if (impl_->registration) depth.units = impl_->registration->apply(depth.units, depth.unit_m);
  return depth;
}

Image<Rgb8> FrameCalibration::calibrate(const Image<Rgb8>& raw) const {
  return impl_->color_lens ? impl_->color_lens->undistort(raw) : raw;
}

}  // namespace hm
