#include "hm/sim/sensor/calibration_rig.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hm {
namespace {

constexpr int kSubPixels = 4;

std::array<Vec3, 4> corners_of(const FlatPicture& picture) {
  const double w = picture.width_m(), h = picture.height_m();
  return {Vec3(0, 0, 0), Vec3(w, 0, 0), Vec3(w, h, 0), Vec3(0, h, 0)};
}

/// Homography from rays (x, y, 1) to positions on the plane of a picture.
struct PlaneMap {
  Mat3 picture_from_ray;
  explicit PlaneMap(const SE3& T_camera_picture) {
    Mat3 ray_from_picture;
    ray_from_picture << T_camera_picture.rotation().col(0), T_camera_picture.rotation().col(1),
        T_camera_picture.translation();
    picture_from_ray = ray_from_picture.inverse();
  }
  /// Position on the picture in metres, and 1/z, which is not positive behind the camera.
  [[nodiscard]] Vec3 at(const Vec2& ray) const {
    const Vec3 p = picture_from_ray * Vec3(ray.x(), ray.y(), 1);
    return {p.x() / p.z(), p.y() / p.z(), p.z()};
  }
};

/// Smooth background without corners.
double background(int x, int y) { return 95 + 35 * std::sin(x * 0.011) * std::cos(y * 0.008 + 0.5); }

std::uint8_t to_gray(double value) { return static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0)); }

}  // namespace

struct FlatRenderer::PixelBox {
  int left = 0, top = 0, right = -1, bottom = -1;
};

CalibrationRig xtion_rig() {
  CalibrationRig rig;
  rig.depth_camera = {
      640, 480, 578.853, 574.608, 316.004, 246.041, {-0.02542, 0.000217, -0.000929, 0.000197, 0}};
  rig.color_camera = {
      640, 480, 537.674, 534.380, 321.226, 249.774, {0.03960, -0.11131, 0.00212, 0.000709, 0}};
  const Vec3 axis = Vec3(0.3, 0.9, 0.3).normalized();
  rig.T_color_depth = SE3(so3_exp(0.56 * M_PI / 180 * axis), Vec3(-0.026010, -0.000053, 0.000568));
  rig.noise = {0.001425, 0, 0};
  return rig;
}

CalibrationRig device_rig(SensorPreset preset) {
  const SensorModel sensor = sensor_model(preset);
  CalibrationRig rig;
  rig.device = sensor;
  rig.color_camera = rig.depth_camera = sensor.camera;
  rig.noise = sensor.noise;
  rig.min_depth_m = sensor.min_depth_m, rig.max_depth_m = sensor.max_depth_m;
  return rig;
}

double simulated_warp_m(const CalibrationRig& rig, const Vec2& pixel, double depth_m) {
  if (rig.device)
    return depth_bias_m(*rig.device, static_cast<int>(pixel.x()), static_cast<int>(pixel.y()), depth_m);
  const double u = 2 * pixel.x() / (rig.depth_camera.width - 1) - 1;
  const double v = 2 * pixel.y() / (rig.depth_camera.height - 1) - 1;
  constexpr double kLargest = 0.8;  // of the shape within the image
  const double shape =
      (0.6 * (u * u + v * v - 1) + 0.4 * std::sin(2.1 * u + 0.7) * std::cos(1.7 * v - 0.4)) / kLargest;
  const double z = depth_m / 4;
  return rig.warp_at_4m_m * shape * (0.7 * z + 0.3) * z;
}

FlatRenderer::FlatRenderer(const PinholeCamera& camera) : camera_(camera) {
  rays_.reserve(static_cast<std::size_t>(camera.width + 1) * static_cast<std::size_t>(camera.height + 1));
  for (int y = 0; y <= camera.height; ++y)
    for (int x = 0; x <= camera.width; ++x)
      rays_.emplace_back(camera.unproject(Vec2(x - 0.5, y - 0.5), 1.0).head<2>().cast<float>());
}

FlatRenderer::PixelBox FlatRenderer::box_of(const FlatPicture& picture, const SE3& T_camera_picture) const {
  Eigen::AlignedBox2d box;
  for (const Vec3& corner : corners_of(picture)) {
    const Vec3 p = T_camera_picture * corner;
    if (p.z() <= 0.01) return {0, 0, camera_.width - 1, camera_.height - 1};
    box.extend(camera_.project(p));
  }
  // Lens distortion bends the edges outwards a little.
  const auto clamped = [](double value, int size) {
    return std::clamp(static_cast<int>(value), 0, size - 1);
  };
  return {clamped(box.min().x() - 20, camera_.width), clamped(box.min().y() - 20, camera_.height),
          clamped(box.max().x() + 20, camera_.width), clamped(box.max().y() + 20, camera_.height)};
}

Image<Rgb8> FlatRenderer::render(const FlatPicture& picture, const SE3& T_camera_picture, double gray_sigma,
                                 Rng& rng) const {
  Image<Rgb8> image(camera_.width, camera_.height);
  const PixelBox box = box_of(picture, T_camera_picture);
  const PlaneMap plane(T_camera_picture);
  const double scale = 1 / picture.pixel_m;
  for (int y = 0; y < camera_.height; ++y) {
    const Eigen::Vector2f* upper = rays_.data() + static_cast<std::ptrdiff_t>(y) * (camera_.width + 1);
    const Eigen::Vector2f* lower = upper + camera_.width + 1;
    for (int x = 0; x < camera_.width; ++x) {
      double gray = background(x, y);
      if (x >= box.left && x <= box.right && y >= box.top && y <= box.bottom) {
        const Vec2 first = upper[x].cast<double>();
        const Vec2 right = (upper[x + 1] - upper[x]).cast<double>(),
                   down = (lower[x] - upper[x]).cast<double>();
        double sum = 0;
        for (int j = 0; j < kSubPixels; ++j)
          for (int i = 0; i < kSubPixels; ++i) {
            // No two rays share a column or row, so that a vertical edge changes the sum in steps of a
            // sixteenth.
            const double a = (i + (j + 0.5) / kSubPixels) / kSubPixels;
            const double b = (j + (i + 0.5) / kSubPixels) / kSubPixels;
            const Vec3 place = plane.at(first + a * right + b * down);
            const double px = place.x() * scale, py = place.y() * scale;
            const bool on = place.z() > 0 && px >= 0 && py >= 0 && px < picture.gray.width() &&
                            py < picture.gray.height();
            // Printed paper: black is not 0, white not 255.
            sum += on ? 30 + 0.75 * picture.gray(static_cast<int>(px), static_cast<int>(py)) : gray;
          }
        gray = sum / (kSubPixels * kSubPixels);
      }
      const std::uint8_t value = to_gray(gray + rng.normal(0, gray_sigma));
      image(x, y) = {value, value, value};
    }
  }
  return image;
}

Image<float> FlatRenderer::depth_m(const FlatPicture& picture, const SE3& T_camera_picture) const {
  Image<float> depth(camera_.width, camera_.height, 0.0F);
  const PixelBox box = box_of(picture, T_camera_picture);
  const PlaneMap plane(T_camera_picture);
  for (int y = box.top; y <= box.bottom; ++y)
    for (int x = box.left; x <= box.right; ++x) {
      const Vec2 ray = camera_.unproject(Vec2(x, y), 1.0).head<2>();
      const Vec3 place = plane.at(ray);
      if (place.z() <= 0 || place.x() < 0 || place.y() < 0 || place.x() > picture.width_m() ||
          place.y() > picture.height_m())
        continue;
      depth(x, y) = static_cast<float>(1 / place.z());
    }
  return depth;
}

DepthImage sense_flat(const CalibrationRig& rig, const Image<float>& true_depth_m, Rng& rng) {
  DepthImage depth{Image<std::uint16_t>(true_depth_m.width(), true_depth_m.height()), rig.depth_unit_m};
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) {
      const auto z = static_cast<double>(true_depth_m(x, y));
      if (z < rig.min_depth_m || z > rig.max_depth_m || rng.uniform() < rig.dropout_ratio) continue;
      const double sigma =
          (rig.noise.quadratic_per_m * z + rig.noise.linear_ratio) * z + rig.noise.constant_m;
      const double reading = z + simulated_warp_m(rig, Vec2(x, y), z) + rng.normal(0, sigma);
      const double units = std::floor(reading / rig.depth_unit_m + 0.5);
      if (units >= 1 && units <= 65534) depth.units(x, y) = static_cast<std::uint16_t>(units);
    }
  return depth;
}

SE3 place_picture(const PinholeCamera& camera, const FlatPicture& picture, const FlatView& view) {
  const Vec3 axis(std::cos(view.tilt_axis_rad), std::sin(view.tilt_axis_rad), 0);
  const Mat3 R = so3_exp(view.tilt_rad * axis) * so3_exp(Vec3(0, 0, view.roll_rad));
  const Vec3 middle = camera.unproject(view.pixel, view.distance_m);
  return {R, middle - R * Vec3(picture.width_m() / 2, picture.height_m() / 2, 0)};
}

bool sees_whole(const PinholeCamera& camera, const FlatPicture& picture, const SE3& T_camera_picture,
                double margin_px) {
  for (const Vec3& corner : corners_of(picture)) {
    const Vec3 p = T_camera_picture * corner;
    if (p.z() < 0.05) return false;
    const Vec2 pixel = camera.project(p);
    if (!(pixel.x() > margin_px && pixel.y() > margin_px && pixel.x() < camera.width - margin_px &&
          pixel.y() < camera.height - margin_px))
      return false;
  }
  return true;
}

}  // namespace hm
