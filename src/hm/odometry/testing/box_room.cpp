#include "hm/odometry/testing/box_room.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace hm {

namespace {

const Vec3 kHalfRoom(2.5, 2.0, 1.3);
const Vec3 kBoxMiddle(1.6, 0.6, -0.4), kHalfBox(0.4, 0.5, 0.9);

struct Hit {
  double distance = std::numeric_limits<double>::infinity();  ///< in lengths of the ray
  int axis = 0;                                               ///< of the wall's normal
};

/// Exit of a ray from inside a box around the origin.
Hit leave_box(const Vec3& origin, const Vec3& ray, const Vec3& half) {
  Hit hit;
  for (int axis = 0; axis < 3; ++axis) {
    if (ray(axis) == 0) continue;
    const double distance = (std::copysign(half(axis), ray(axis)) - origin(axis)) / ray(axis);
    if (distance > 0 && distance < hit.distance) hit = {distance, axis};
  }
  return hit;
}

/// Entry of a ray from outside into a box, if any.
Hit enter_box(const Vec3& origin, const Vec3& ray, const Vec3& half) {
  Hit in{0, 0};
  double out = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double near = (-std::copysign(half(axis), ray(axis)) - origin(axis)) / ray(axis);
    const double far = (std::copysign(half(axis), ray(axis)) - origin(axis)) / ray(axis);
    if (near > in.distance) in = {near, axis};
    out = std::min(out, far);
  }
  return in.distance > 0 && in.distance < out ? in : Hit{};
}

/// Random numbers in 0..1 by place, the same everywhere.
double table(std::uint64_t seed, int u, int v, int layer) {
  static const std::vector<double> kValues = [] {
    Rng rng(11);
    std::vector<double> values(8191);
    for (double& value : values) value = rng.uniform();
    return values;
  }();
  const std::int64_t key =
      std::int64_t{u} * 131 + std::int64_t{v} * 4099 + layer * 577 + static_cast<int>(seed) * 1031;
  return kValues[static_cast<std::size_t>(((key % 8191) + 8191) % 8191)];
}

double brightness(const BoxRoom& room, const Vec3& p, const Hit& hit, int object) {
  const double u = p((hit.axis + 1) % 3), v = p((hit.axis + 2) % 3);
  const int layer = hit.axis + 3 * (p(hit.axis) > 0 ? 1 : 0) + 6 * object;
  const auto cell = [](double x, double size) { return static_cast<int>(std::floor(x / size)); };
  const double coarse = table(room.texture_seed, cell(u, 0.31), cell(v, 0.31), layer);
  const double fine = table(room.texture_seed, cell(u, 0.083), cell(v, 0.083), layer + 50);
  return 25 + 110 * coarse + 100 * fine;
}

struct Sample {
  double depth_m = 0, brightness = 0;
};

Sample look(const BoxRoom& room, const SE3& T_world_camera, const Vec3& ray_camera) {
  const Vec3 ray = T_world_camera.rotation() * ray_camera;
  const Vec3& origin = T_world_camera.translation();
  const Hit wall = leave_box(origin, ray, kHalfRoom);
  const Hit box = enter_box(origin - kBoxMiddle, ray, kHalfBox);
  const bool is_box = box.distance < wall.distance;
  const Hit& hit = is_box ? box : wall;
  const Vec3 p = origin + hit.distance * ray;
  return {hit.distance, brightness(room, is_box ? Vec3(p - kBoxMiddle) : p, hit, is_box ? 1 : 0)};
}

}  // namespace

RgbdFrame render(const BoxRoom& room, const PinholeCamera& camera, const SE3& T_world_camera,
                 double stamp_s) {
  RgbdFrame frame;
  frame.stamp = frame.color_stamp = Time::from_seconds(stamp_s);
  frame.depth.unit_m = 2e-4;
  frame.depth.units = Image<std::uint16_t>(camera.width, camera.height);
  frame.color = Image<Rgb8>(camera.width, camera.height);
  frame.T_world_camera = T_world_camera;
  Rng rng(room.texture_seed, static_cast<std::uint64_t>(frame.stamp.ns));
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      double sum = 0;
      for (int i = 0; i < 4; ++i) {
        const Vec2 at(x + 0.5 * (i % 2) - 0.25, y + 0.5 * (i / 2) - 0.25);
        sum += look(room, T_world_camera, camera.unproject(at, 1.0)).brightness;
      }
      const auto level = static_cast<std::uint8_t>(std::lround(sum / 4));
      frame.color(x, y) = {level, level, level};
      const double z = look(room, T_world_camera, camera.unproject(Vec2(x, y), 1.0)).depth_m;
      const double noise = room.depth_noise_per_m > 0 ? rng.normal(0, room.depth_noise_per_m * z * z) : 0;
      frame.depth.units(x, y) = static_cast<std::uint16_t>(std::lround((z + noise) / frame.depth.unit_m));
    }
  }
  return frame;
}

PinholeCamera small_camera() { return {320, 240, 277, 277, 159.5, 119.5, {}}; }

SE3 way_through_room(double t_s) {
  Mat3 forward;  // the camera looks along x, its y axis down
  forward << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Vec3 place(-1.2 + 0.3 * std::sin(0.9 * t_s), 0.4 * std::sin(0.7 * t_s), 0.15 * std::sin(1.1 * t_s));
  const Mat3 turn =
      so3_exp(Vec3(0, 0, 0.35 * std::sin(0.6 * t_s))) * so3_exp(Vec3(0.05 * std::sin(t_s), 0, 0));
  return {turn * forward, place};
}

}  // namespace hm
