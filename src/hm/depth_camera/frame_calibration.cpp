#include "hm/depth_camera/frame_calibration.hpp"

#include <mutex>
#include <optional>
#include <vector>

#include "hm/depth_camera/depth_registration.hpp"
#include "hm/depth_camera/lens_map.hpp"

namespace hm {

struct FrameCalibration::Impl {
  int width = 0, height = 0;
  PinholeCamera camera;
  std::shared_ptr<const LensMap> depth_lens, color_lens;  ///< one for both where they are one camera
  std::optional<DisparityModel> disparity;
  std::optional<DepthCorrection> correction;
  std::optional<DepthRegistration> registration;
  /// Intermediate images of calibrate() for reuse: allocating new ones for every frame would add half of the
  /// time.
  mutable std::mutex spare_mutex;
  mutable std::vector<Image<std::uint16_t>> spare;

  [[nodiscard]] Image<std::uint16_t> take_spare() const {
    const std::lock_guard lock(spare_mutex);
    if (spare.empty()) return {};
    Image<std::uint16_t> image = std::move(spare.back());
    spare.pop_back();
    return image;
  }
  void give_back(Image<std::uint16_t> image) const {
    const std::lock_guard lock(spare_mutex);
    spare.push_back(std::move(image));
  }
};

namespace {

/// Scales the camera to another size with the same aspect ratio.
Result<PinholeCamera> fitted(const PinholeCamera& camera, const char* name, int width, int height) {
  if (camera.width == width && camera.height == height) return camera;
  if (static_cast<std::int64_t>(camera.width) * height != static_cast<std::int64_t>(camera.height) * width)
    return fail(ErrorCode::kInvalidValue, "", "the calibration's {} is {} x {}, the images are {} x {}", name,
                camera.width, camera.height, width, height);
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
  impl->width = width, impl->height = height;
  impl->disparity = calibration.disparity;
  const auto& given_depth = calibration.depth_camera ? calibration.depth_camera : calibration.color_camera;
  const auto& given_color = calibration.color_camera ? calibration.color_camera : calibration.depth_camera;
  if (!given_depth) return fail(ErrorCode::kInvalidValue, "", "the calibration names no camera");
  const auto depth = fitted(*given_depth, "depth camera", width, height);
  if (!depth) return forward_error(depth);
  const auto color = fitted(*given_color, "colour camera", width, height);
  if (!color) return forward_error(color);
  if (const auto& model = calibration.depth_correction) {
    if (static_cast<std::int64_t>(model->width) * height != static_cast<std::int64_t>(model->height) * width)
      return fail(ErrorCode::kInvalidValue, "", "the depth correction is for {} x {}, the images are {} x {}",
                  model->width, model->height, width, height);
    impl->correction.emplace(*model, width, height);
  }
  if (!depth->distortion.is_zero()) impl->depth_lens = std::make_shared<const LensMap>(*depth);
  if (&given_depth == &given_color)
    impl->color_lens = impl->depth_lens;
  else if (!color->distortion.is_zero())
    impl->color_lens = std::make_shared<const LensMap>(*color);
  impl->camera = depth->without_distortion();
  if (calibration.registers_depth()) {
    impl->registration.emplace(depth->without_distortion(), color->without_distortion(),
                               *calibration.T_color_depth);
    impl->camera = color->without_distortion();
  }
  return FrameCalibration(std::move(impl));
}

const PinholeCamera& FrameCalibration::camera() const { return impl_->camera; }

DepthImage FrameCalibration::calibrate(DepthImage depth) const {
  const Impl& impl = *impl_;
  if (impl.disparity) DisparityTable(*impl.disparity, depth.unit_m).apply(depth.units);
  Image<std::uint16_t> other = impl.take_spare();
  if (impl.depth_lens) {
    impl.depth_lens->undistort(depth.units, other);
    std::swap(depth.units, other);
  }
  if (impl.correction) impl.correction->apply(depth);
  if (impl.registration) {
    impl.registration->apply(depth.units, depth.unit_m, other);
    std::swap(depth.units, other);
  }
  impl.give_back(std::move(other));
  return depth;
}

Image<Rgb8> FrameCalibration::calibrate(Image<Rgb8> color) const {
  return impl_->color_lens ? impl_->color_lens->undistort(color) : color;
}

}  // namespace hm
