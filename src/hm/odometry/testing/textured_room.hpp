#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "hm/core/rng.hpp"
#include "hm/sensors/depth_noise.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Box-shaped room seen from inside, with a random texture that is a function of position: exact depth and
/// colour for any pose.
struct TexturedRoom {
  Vec3 half_size_m{2.0, 1.4, 1.8};
  std::uint32_t seed = 1;
  double contrast = 1;    ///< 0: blank walls
  double brightness = 1;  ///< 0: dark
};

inline double lattice_value(std::uint32_t seed, int x, int y, int z) {
  std::uint32_t h = seed * 0x9e3779b1u ^ static_cast<std::uint32_t>(x) * 0x85ebca6bu ^
                    static_cast<std::uint32_t>(y) * 0xc2b2ae35u ^ static_cast<std::uint32_t>(z) * 0x27d4eb2fu;
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  h ^= h >> 12;
  h *= 0x297a2d39u;
  h ^= h >> 15;
  return static_cast<double>(h & 0xffff) / 65535.0;
}

/// Smooth random values between 0 and 1, one per lattice cell of `cell_m`.
inline double pattern(std::uint32_t seed, const Vec3& p, double cell_m) {
  const Vec3 q = p / cell_m;
  const Vec3 base(std::floor(q.x()), std::floor(q.y()), std::floor(q.z()));
  Vec3 w = q - base;
  for (int i = 0; i < 3; ++i) w[i] = w[i] * w[i] * (3 - 2 * w[i]);
  double sum = 0;
  for (int k = 0; k < 8; ++k) {
    const int dx = k & 1, dy = k >> 1 & 1, dz = k >> 2;
    const double weight = (dx ? w.x() : 1 - w.x()) * (dy ? w.y() : 1 - w.y()) * (dz ? w.z() : 1 - w.z());
    sum += weight * lattice_value(seed, static_cast<int>(base.x()) + dx, static_cast<int>(base.y()) + dy,
                                  static_cast<int>(base.z()) + dz);
  }
  return sum;
}

/// Grey level (0 to 255) of a room's surface at a point.
inline double texture_level(const TexturedRoom& room, const Vec3& p) {
  const double value = 0.55 * pattern(room.seed, p, 0.11) + 0.45 * pattern(room.seed + 1, p, 0.035);
  return room.brightness * 255 * std::clamp(0.5 + room.contrast * 1.6 * (value - 0.5), 0.0, 1.0);
}

inline Rgb8 gray_pixel(double level) {
  const auto gray = static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L));
  return {gray, gray, gray};
}

inline PinholeCamera room_camera() { return {320, 240, 262.5, 262.5, 159.5, 119.5, {}}; }

struct RoomNoise {
  bool depth = false;  ///< of a Kinect, independent from pixel to pixel
  double gray_sigma = 0;
  DepthNoise model;
};

/// Renders the frame of a camera in the room. `rng` may be null without noise.
inline RgbdFrame render_room(const TexturedRoom& room, const PinholeCamera& camera, const SE3& T_world_camera,
                             Time stamp, const RoomNoise& noise = {}, Rng* rng = nullptr) {
  RgbdFrame frame;
  frame.stamp = frame.color_stamp = stamp;
  frame.T_world_camera = T_world_camera;
  frame.depth.unit_m = 1.0 / 5000;
  frame.depth.units = Image<std::uint16_t>(camera.width, camera.height);
  frame.color = Image<Rgb8>(camera.width, camera.height);
  const Vec3& eye = T_world_camera.translation();
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 ray = T_world_camera.rotation() * camera.unproject(Vec2(x, y), 1.0);
      double z = 1e9;
      for (int axis = 0; axis < 3; ++axis)
        if (ray[axis] != 0)
          z = std::min(z, (std::copysign(room.half_size_m[axis], ray[axis]) - eye[axis]) / ray[axis]);
      const Vec3 p = eye + z * ray;
      double level = texture_level(room, p);
      if (rng && noise.gray_sigma > 0) level += rng->normal(0, noise.gray_sigma);
      frame.color(x, y) = gray_pixel(level);
      if (rng && noise.depth) z += rng->normal(0, noise.model.sigma_m(z));
      frame.depth.units(x, y) = static_cast<std::uint16_t>(std::clamp(std::lround(z * 5000), 1L, 65535L));
    }
  return frame;
}

/// Pose on a smooth path around the room's centre, with translations of a few decimetres and rotations.
inline SE3 path_pose(double t_s) {
  const Vec3 p(0.35 * std::sin(0.9 * t_s), 0.2 * std::sin(1.3 * t_s), 0.3 * (std::cos(0.7 * t_s) - 1));
  return {so3_exp(Vec3(0.15 * std::sin(1.1 * t_s), 0.5 * std::sin(0.6 * t_s), 0.08 * std::sin(0.8 * t_s))),
          p};
}

}  // namespace hm
