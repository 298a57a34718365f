#include "hm/depth_camera/frame_calibration.hpp"

#include <algorithm>
#include <mutex>
#include <optional>
#include <vector>

#include "hm/core/aligned_vector.hpp"
#include "hm/core/round_up.hpp"
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
  /// Canvases are large: taken from the system for every frame, they would cost more than they are for.
  mutable std::mutex canvases_mutex;
  mutable std::vector<std::unique_ptr<DepthRegistration::Canvas>> canvases;

  [[nodiscard]] std::unique_ptr<DepthRegistration::Canvas> take_canvas() const {
    const std::lock_guard lock(canvases_mutex);
    if (canvases.empty()) return std::make_unique<DepthRegistration::Canvas>(*registration);
    auto canvas = std::move(canvases.back());
    canvases.pop_back();
    return canvas;
  }
  void give_back(std::unique_ptr<DepthRegistration::Canvas> canvas) const {
    const std::lock_guard lock(canvases_mutex);
    canvases.push_back(std::move(canvas));
  }
};

namespace {

constexpr std::size_t kRowSlack_px =
    std::max({LensMap::kRowSlack_px, DepthCorrection::kRowSlack_px, DepthRegistration::kRowSlack_px});

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
  impl->width = width, impl->height = height;
  impl->disparity = calibration.disparity;
  const auto& given_depth = calibration.depth_camera ? calibration.depth_camera : calibration.color_camera;
  const auto& given_color = calibration.color_camera ? calibration.color_camera : calibration.depth_camera;
  if (!given_depth) return fail(ErrorCode::kInvalidValue, "", "the calibration names no camera");
  const auto depth = fitted(*given_depth, "depth camera", width, height);
  if (!depth) return forward_error(depth);
  const auto color = fitted(*given_color, "colour camera", width, height);
  if (!color) return forward_error(color);
  if (calibration.registers_depth() && !DepthRegistration::fits(*color))
    return fail(ErrorCode::kInvalidValue, "", "pictures of {} x {} are too large to register depth to", width,
                height);
  if (const auto& model = calibration.depth_correction) {
    if (static_cast<std::int64_t>(model->width) * height != static_cast<std::int64_t>(model->height) * width)
      return fail(ErrorCode::kInvalidValue, "",
                  "the depth correction is for {} x {}, the pictures are {} x {}", model->width,
                  model->height, width, height);
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

/// Row by row, so that everything between the first reading and the last writing stays near the processor.
DepthImage FrameCalibration::calibrate(DepthImage depth) const {
  const Impl& impl = *impl_;
  if (impl.disparity) DisparityTable(*impl.disparity, depth.unit_m).apply(depth.units);
  if (!impl.depth_lens && !impl.correction && !impl.registration) return depth;
  const int width = depth.width(), height = depth.height();
  HM_CHECK(width == impl.width && height == impl.height, "{} x {}", width, height);
  std::optional<DepthCorrection::Rows> correction;
  if (impl.correction) correction.emplace(*impl.correction, depth.unit_m);
  std::unique_ptr<DepthRegistration::Canvas> canvas;
  if (impl.registration) {
    canvas = impl.take_canvas();
    canvas->begin(depth.unit_m);
  }
  Image<std::uint16_t> rectified;
  if (!canvas) rectified = Image<std::uint16_t>(width, height);
  const int whole_width = round_up(width, DepthRegistration::kRowSlack_px);
  AlignedVector<std::uint16_t> row(static_cast<std::size_t>(width) + kRowSlack_px), corrected(row.size());
  for (int y = 0; y < height; ++y) {
    if (impl.depth_lens)
      impl.depth_lens->undistort_row(depth.units, y, row.data());
    else
      std::ranges::copy(depth.units.row(y), row.begin());
    if (correction) {
      correction->apply(y, row.data(), corrected.data());
      row.swap(corrected);
    }
    if (canvas) {
      // What is left of other rows would look like readings that may go anywhere, which costs time.
      std::fill(row.begin() + width, row.begin() + whole_width, std::uint16_t{0});
      canvas->add_row(y, row.data());
    } else {
      std::copy_n(row.data(), width, rectified.row(y).data());
    }
  }
  if (canvas) {
    canvas->finish(depth.units);
    impl.give_back(std::move(canvas));
  } else {
    depth.units = std::move(rectified);
  }
  return depth;
}

Image<Rgb8> FrameCalibration::calibrate(Image<Rgb8> color) const {
  return impl_->color_lens ? impl_->color_lens->undistort(color) : color;
}

}  // namespace hm
