#pragma once
#include <cmath>
#include <numbers>
#include <optional>

#include "hm/odometry/testing/textured_room.hpp"

namespace hm::bench {

/// People drawn into the frames of a recording whose poses are known (z up): upright cylinders in patterned
/// clothes that walk to and fro in front of where the camera was first, across its view.
struct DrawnPeople {
  int count = 1;
  double distance_m = 1, swing_m = 0.75, period_s = 6;
  double contrast = 4;  ///< of their clothes; 1: as a wall's
  std::optional<SE3> T_world_first{};
  double start_s = 0;

  static constexpr double kRadius_m = 0.25, kAbove_m = 0.35, kBelow_m = 1.6, kApart_m = 0.25;

  void draw(const PinholeCamera& camera, RgbdFrame& frame) {
    if (!frame.T_world_camera) return;
    if (!T_world_first) T_world_first = frame.T_world_camera, start_s = frame.stamp.seconds();
    for (int person = 0; person < count; ++person) draw(person, camera, frame);
  }

 private:
  void draw(int person, const PinholeCamera& camera, RgbdFrame& frame) const {
    const Vec3 up = Vec3::UnitZ(), eye = frame.T_world_camera->translation();
    Vec3 ahead = T_world_first->rotation().col(2);
    ahead = (ahead - up * ahead.z()).normalized();
    const double phase = (frame.stamp.seconds() - start_s) / period_s + static_cast<double>(person) / count;
    const Vec3 middle = T_world_first->translation() + (distance_m + kApart_m * person) * ahead +
                        swing_m * std::sin(2 * std::numbers::pi * phase) * ahead.cross(up);
    Vec3 from = eye - middle;
    from.z() = 0;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const Vec3 ray = frame.T_world_camera->rotation() * camera.unproject(Vec2(x, y), 1.0);
        const double a = ray.head<2>().squaredNorm(), b = ray.dot(from);
        const double root = b * b - a * (from.squaredNorm() - kRadius_m * kRadius_m);
        const double z = root > 0 ? (-b - std::sqrt(root)) / a : 0;
        const Vec3 hit = eye + z * ray;
        const double height = hit.z() - T_world_first->translation().z();
        const double behind_m = frame.depth.depth_m(x, y);
        if (z < 0.3 || height > kAbove_m || height < -kBelow_m || (behind_m > 0 && z > behind_m)) continue;
        frame.depth.units(x, y) = static_cast<std::uint16_t>(std::lround(z / frame.depth.unit_m));
        frame.color(x, y) = cloth(person, hit - middle, height, ahead);
      }
  }

  [[nodiscard]] Rgb8 cloth(int person, const Vec3& place, double height, const Vec3& ahead) const {
    const double around_m = kRadius_m * std::atan2(place.cross(ahead).z(), place.dot(ahead));
    const auto seed = static_cast<std::uint32_t>(90 + 2 * person);
    const Vec3 p(around_m, height, 0);
    const double value = 0.5 * pattern(seed, p, 0.08) + 0.5 * pattern(seed + 1, p, 0.03);
    return gray_pixel(255 * (0.5 + contrast * (value - 0.5)));
  }
};

}  // namespace hm::bench
