#include "hm/sim/recording/flawed_camera.hpp"

#include <algorithm>
#include <cmath>

#include "hm/sim/sensor/glass.hpp"

namespace hm {
namespace {

constexpr double kMiddleGray = 120;  ///< mean that automatic exposure aims at
constexpr int kMeterWidth = 40;      ///< pixels of the images that it measures
constexpr int kMeterings = 5;        ///< number of them, in three time constants
constexpr int kMostExposures = 8;    ///< images of which a blurred one is the mean
constexpr double kBlurDepth_m = 2;   ///< a translation moves pixels as at this depth

PinholeCamera scaled_down(const PinholeCamera& camera, int width) {
  const double scale = static_cast<double>(width) / camera.width;
  PinholeCamera small = camera;
  small.width = width, small.height = static_cast<int>(scale * camera.height);
  small.fx *= scale, small.fy *= scale;
  small.cx = scale * (camera.cx + 0.5) - 0.5, small.cy = scale * (camera.cy + 0.5) - 0.5;
  return small;
}

Eigen::Vector3f mean_color(const Image<Rgb8>& image) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Rgb8& c : image.pixels()) sum += Eigen::Vector3d(c.r, c.g, c.b);
  return (sum / static_cast<double>(image.pixels().size())).cast<float>();
}

}  // namespace

FlawedCamera::FlawedCamera(const Setup& setup)
    : setup_(setup),
      depth_camera_(true_camera(setup.stated_camera, setup.sizes)),
      color_camera_(depth_camera_) {
  const FlawSizes& sizes = setup.sizes;
  color_camera_.cx += sizes.color_shift_x_px;
  color_camera_.cy += sizes.color_shift_y_px;
  color_camera_.fx *= 1 + sizes.color_focal_ratio;
  color_camera_.fy *= 1 + sizes.color_focal_ratio;
  T_depth_color_ = SE3(Mat3::Identity(), Vec3(sizes.color_baseline_m + sizes.color_beside_m, 0, 0));
  if (sizes.people > 0) people_.emplace(setup.walk, sizes.people, setup.seed);
}

SE3 FlawedCamera::T_world_camera(double elapsed_s) const {
  return setup_.walk.T_world_camera(elapsed_s / setup_.duration_scale_ratio);
}

RenderedView FlawedCamera::seen(const PinholeCamera& camera, std::span<const SE3> T_world_camera,
                                double elapsed_s, const ParallelLoop& loop) const {
  RenderedView view = setup_.renderer.render(camera, T_world_camera, loop);
  if (setup_.sizes.flaws.has(Flaw::kGlass))
    look_through_glass(setup_.world, setup_.renderer, camera, T_world_camera, setup_.sizes.glass_angle_rad,
                       view);
  if (people_) people_->draw(camera, T_world_camera, elapsed_s / setup_.duration_scale_ratio, view);
  return view;
}

RenderedView FlawedCamera::view(const SE3& T_world_camera, double elapsed_s, const ParallelLoop& loop) const {
  const std::vector<SE3> poses(static_cast<std::size_t>(depth_camera_.height), T_world_camera);
  return seen(depth_camera_, poses, elapsed_s, loop);
}

/// Poses of the rows of the colour camera, the middle row exposed at this time.
std::vector<SE3> FlawedCamera::row_poses(const PinholeCamera& camera, double middle_s) const {
  std::vector<SE3> poses;
  for (int row = 0; row < camera.height; ++row) {
    const double share = static_cast<double>(row) / std::max(1, camera.height - 1) - 0.5;
    poses.push_back(T_world_camera(middle_s + share * setup_.sizes.readout_s) * T_depth_color_);
  }
  return poses;
}

/// Number of images whose mean is blurred without gaps of more than about a pixel.
int FlawedCamera::exposures(double middle_s) const {
  const double half_s = 0.5 * setup_.sizes.exposure_s;
  if (half_s == 0) return 1;
  const SE3 motion = T_world_camera(middle_s - half_s).inverse() * T_world_camera(middle_s + half_s);
  const double moved_px =
      color_camera_.fx * (so3_log(motion.rotation()).norm() + motion.translation().norm() / kBlurDepth_m);
  return std::clamp(1 + static_cast<int>(std::ceil(moved_px)), 2, kMostExposures);
}

Eigen::Vector3f FlawedCamera::gains(double elapsed_s) const {
  if (!setup_.sizes.flaws.has(Flaw::kExposure)) return Eigen::Vector3f::Ones();
  const PinholeCamera meter = scaled_down(color_camera_, kMeterWidth);
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  float weights = 0;
  for (int i = 1; i <= kMeterings; ++i) {
    const double lags = 3.0 * i / kMeterings, at_s = elapsed_s - lags * setup_.sizes.exposure_lag_s;
    const auto weight = static_cast<float>(std::exp(-lags));
    const std::vector<SE3> poses(static_cast<std::size_t>(meter.height),
                                 T_world_camera(at_s) * T_depth_color_);
    mean += weight * mean_color(seen(meter, poses, at_s, ParallelLoop()).color);
    weights += weight;
  }
  mean = (mean / weights).cwiseMax(1.0f);
  const float brightness = std::clamp(static_cast<float>(kMiddleGray) / mean.mean(), 0.5f, 2.0f);
  const auto balance = static_cast<float>(setup_.sizes.white_balance_ratio);
  return brightness * (mean.mean() / mean.array()).pow(balance).matrix();
}

Image<Rgb8> FlawedCamera::color(double elapsed_s, const ParallelLoop& loop) const {
  const double middle_s = elapsed_s + setup_.sizes.color_delay_s;
  const int count = exposures(middle_s);
  Image<Eigen::Vector3f> sum(color_camera_.width, color_camera_.height, Eigen::Vector3f::Zero());
  for (int i = 0; i < count; ++i) {
    const double at_s = middle_s + ((i + 0.5) / count - 0.5) * setup_.sizes.exposure_s;
    const RenderedView one = seen(color_camera_, row_poses(color_camera_, at_s), at_s, loop);
    for (std::size_t k = 0; k < sum.pixels().size(); ++k) {
      const Rgb8& c = one.color.pixels()[k];
      sum.pixels()[k] += Eigen::Vector3f(c.r, c.g, c.b);
    }
  }
  const Eigen::Vector3f factor = gains(middle_s) / static_cast<float>(count);
  Image<Rgb8> color(sum.width(), sum.height());
  for (std::size_t k = 0; k < sum.pixels().size(); ++k) {
    const Eigen::Vector3f c = (sum.pixels()[k].cwiseProduct(factor).array() + 0.5f).min(255.0f).matrix();
    color.pixels()[k] = {static_cast<std::uint8_t>(c.x()), static_cast<std::uint8_t>(c.y()),
                         static_cast<std::uint8_t>(c.z())};
  }
  return color;
}

}  // namespace hm
