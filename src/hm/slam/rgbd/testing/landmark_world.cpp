#include "hm/slam/rgbd/testing/landmark_world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/core/testing/drawn_vector.hpp"

namespace hm::test {
namespace {

constexpr double kHalfWidth_m = 1.0, kHeight_m = 2.5;

/// Random point on the surface of a corridor of this length along x, centred at y = 0.
Vec3 on_corridor(double length_m, Rng& rng) {
  const double x = rng.uniform(0, length_m), across = rng.uniform(0, 2 * (kHeight_m + 2 * kHalfWidth_m));
  if (across < kHeight_m) return {x, -kHalfWidth_m, across};
  if (across < 2 * kHeight_m) return {x, kHalfWidth_m, across - kHeight_m};
  const double y = across - 2 * kHeight_m;
  return y < 2 * kHalfWidth_m ? Vec3(x, y - kHalfWidth_m, 0) : Vec3(x, y - 3 * kHalfWidth_m, kHeight_m);
}

}  // namespace

PinholeCamera landmark_camera() { return {640, 480, 525, 525, 319.5, 239.5, {}}; }

BinaryDescriptor random_descriptor(Rng& rng) {
  BinaryDescriptor descriptor{};
  for (std::uint64_t& word : descriptor)
    word = (static_cast<std::uint64_t>(rng.next_u32()) << 32) | rng.next_u32();
  return descriptor;
}

BinaryDescriptor noisy(const BinaryDescriptor& descriptor, double ratio, Rng& rng) {
  BinaryDescriptor wrong = descriptor;
  for (std::uint64_t& word : wrong)
    for (int bit = 0; bit < 64; ++bit)
      if (rng.uniform() < ratio) word ^= std::uint64_t{1} << bit;
  return wrong;
}

LandmarkWorld corridor(double length_m, int points_per_metre, Rng& rng) {
  LandmarkWorld world;
  for (int i = 0; i < static_cast<int>(length_m * points_per_metre); ++i)
    world.points.push_back({on_corridor(length_m, rng), random_descriptor(rng)});
  return world;
}

LandmarkWorld periodic_corridor(double length_m, double period_m, int points_per_metre, Rng& rng) {
  const LandmarkWorld once = corridor(period_m, points_per_metre, rng);
  LandmarkWorld world;
  for (double x = 0; x < length_m; x += period_m)
    for (const auto& point : once.points)
      world.points.push_back({point.p_world + Vec3(x, 0, 0), point.descriptor});
  return world;
}

LandmarkWorld ring(double side_m, int points_per_metre, Rng& rng) {
  LandmarkWorld world;
  for (int side = 0; side < 4; ++side) {
    const Mat3 turn = so3_exp(Vec3(0, 0, side * std::numbers::pi / 2));
    for (auto& point : corridor(side_m, points_per_metre, rng).points)
      world.points.push_back({turn * (point.p_world - Vec3(side_m / 2, side_m / 2, 0)), point.descriptor});
  }
  return world;
}

SE3 level_camera(double x_m, double y_m, double yaw_rad) {
  Mat3 looking_along_x;  // camera: x right, y down, z forward
  looking_along_x << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {so3_exp(Vec3(0, 0, yaw_rad)) * looking_along_x, Vec3(x_m, y_m, 1.3)};
}

FeatureSet see(const LandmarkWorld& world, const SE3& T_world_camera, Rng& rng, const SeenOptions& options) {
  const PinholeCamera camera = landmark_camera();
  const SE3 T_camera_world = T_world_camera.inverse();
  FeatureSet features;
  for (const auto& point : world.points) {
    const Vec3 p = T_camera_world * point.p_world;
    if (p.z() < 0.5 || p.z() > options.max_depth_m || !camera.contains(camera.project(p))) continue;
    if (features.size() == options.max_features) break;
    Feature feature;
    const double sigma_m = options.depth_sigma_per_m * p.z() * p.z();
    feature.pixel = camera.project(p) + options.pixel_sigma_px * drawn<2>([&] { return rng.normal(); });
    feature.descriptor = noisy(point.descriptor, options.wrong_bits_ratio, rng);
    feature.has_depth = true;
    const double z = p.z() + sigma_m * rng.normal();
    feature.p_camera = camera.unproject(feature.pixel, z);
    const Vec3 ray = feature.p_camera / z;
    const double across_m = options.pixel_sigma_px * z / camera.fx;
    feature.covariance = sigma_m * sigma_m * ray * ray.transpose() +
                         Mat3(Vec3(across_m * across_m, across_m * across_m, 1e-10).asDiagonal());
    features.push_back(feature);
  }
  return features;
}

DepthImage depth_in_room(const Vec3& half_size_m, const SE3& T_world_depth, Rng& rng,
                         const ReadingError& error) {
  const PinholeCamera camera = landmark_camera();
  DepthImage depth{Image<std::uint16_t>(camera.width, camera.height), 1.0 / 5000};
  const Vec3& eye = T_world_depth.translation();
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 ray = T_world_depth.rotation() * camera.unproject(Vec2(x, y), 1.0);
      double z = 12;
      for (int axis = 0; axis < 3; ++axis)
        if (ray[axis] != 0)
          z = std::min(z, (std::copysign(half_size_m[axis], ray[axis]) - eye[axis]) / ray[axis]);
      double reading_m = error.scale * z / (1 - error.offset_1_m * z);
      reading_m += rng.normal(0, DepthNoise().sigma_m(reading_m));
      depth.units(x, y) = static_cast<std::uint16_t>(std::lround(reading_m / depth.unit_m));
    }
  return depth;
}

KeyframesOfWay walk(const LandmarkWorld& world, const std::vector<SE3>& way, double drift_rad_m, Rng& rng) {
  KeyframesOfWay result;
  SE3 T_odom_camera = way.front();
  for (std::size_t i = 0; i < way.size(); ++i) {
    if (i > 0) {
      const SE3 motion = way[i - 1].inverse() * way[i];
      const double turned_rad = drift_rad_m * motion.translation().norm();
      T_odom_camera = T_odom_camera * motion * SE3(so3_exp(Vec3(0, turned_rad, 0)), Vec3(0, 0, 0));
    }
    Keyframe keyframe;
    keyframe.frame_index = 10 * i;
    keyframe.stamp = Time::from_seconds(0.5 * static_cast<double>(i + 1));
    keyframe.T_odom_camera = T_odom_camera;
    keyframe.features = see(world, way[i], rng);
    result.keyframes.push_back(std::make_shared<const Keyframe>(std::move(keyframe)));
    result.truth.push_back(way[i]);
  }
  return result;
}

std::vector<SE3> way_around(double side_m, double step_m, double rounds) {
  // Along the middle of a square with rounded corners.
  std::vector<SE3> way;
  const double half = side_m / 2, corner = 1.0;
  const double straight = side_m - 2 * corner, arc = corner * std::numbers::pi / 2;
  for (double at = 0; at < rounds * 4 * (straight + arc); at += step_m) {
    const double turns = std::floor(at / (straight + arc)), rest = at - turns * (straight + arc);
    Vec3 place(-half + corner + std::min(rest, straight), -half, 0);
    double yaw = 0;
    if (rest > straight) {
      yaw = (rest - straight) / corner;
      place += corner * Vec3(std::sin(yaw), 1 - std::cos(yaw), 0);
    }
    const double turned = turns * std::numbers::pi / 2;
    place = so3_exp(Vec3(0, 0, turned)) * place;
    way.push_back(level_camera(place.x(), place.y(), yaw + turned));
  }
  return way;
}

}  // namespace hm::test
