#include "hm/tsdf/testing/analytic_scene.hpp"

#include <cmath>
#include <limits>

namespace hm {

double AnalyticScene::distance(const Vec3& p_world) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Plane& plane : planes) nearest = std::min(nearest, plane.normal.dot(p_world) - plane.offset_m);
  for (const Ball& ball : balls) nearest = std::min(nearest, (p_world - ball.centre).norm() - ball.radius_m);
  return nearest;
}

double AnalyticScene::cast(const Vec3& origin, const Vec3& direction) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Plane& plane : planes) {
    const double t = (plane.offset_m - plane.normal.dot(origin)) / plane.normal.dot(direction);
    if (t > 0 && plane.normal.dot(direction) < 0) nearest = std::min(nearest, t);
  }
  for (const Ball& ball : balls) {
    const Vec3 from = origin - ball.centre;
    const double b = from.dot(direction), c = from.squaredNorm() - ball.radius_m * ball.radius_m;
    const double discriminant = b * b - direction.squaredNorm() * c;
    if (discriminant < 0) continue;
    const double t = (-b - std::sqrt(discriminant)) / direction.squaredNorm();
    if (t > 0) nearest = std::min(nearest, t);
  }
  return nearest;
}

RgbdFrame AnalyticScene::render(const PinholeCamera& camera, const SE3& T_world_camera, double unit_m) const {
  RgbdFrame frame;
  frame.T_world_camera = T_world_camera;
  frame.depth = {Image<std::uint16_t>(camera.width, camera.height), unit_m};
  frame.color = Image<Rgb8>(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 ray = T_world_camera.rotation() * camera.unproject(Vec2(x, y), 1.0);  // its length is z
      const double z = cast(T_world_camera.translation(), ray);
      if (!(z < 60000 * unit_m)) continue;
      frame.depth.units(x, y) = static_cast<std::uint16_t>(std::lround(z / unit_m));
      const Vec3 at = T_world_camera.translation() + z * ray;
      const auto channel = [](double v) {
        return static_cast<std::uint8_t>(127.5 + 127.0 * std::sin(3 * v));
      };
      frame.color(x, y) = {channel(at.x()), channel(at.y()), channel(at.z())};
    }
  return frame;
}

AnalyticScene random_scene(Rng& rng) {
  const auto vector = [&] { return Vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)); };
  AnalyticScene scene;
  scene.planes.push_back({(Vec3(-1, 0, 0) + 0.5 * vector()).normalized(), -rng.uniform(1.5, 3.0)});
  scene.planes.push_back({Vec3(0, 0, 1), -rng.uniform(0.6, 1.2)});
  for (int i = 0; i < 4; ++i) scene.balls.push_back({Vec3(1.8, 0, 0) + vector(), rng.uniform(0.05, 0.4)});
  return scene;
}

SE3 looking_along_x(const Vec3& position) {
  Mat3 rotation;  // columns: image right = -y, image down = -z, optical axis = +x
  rotation << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {rotation, position};
}

SE3 random_pose(Rng& rng) {
  const auto vector = [&] { return Vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)); };
  const SE3 base = looking_along_x(0.3 * vector());
  return {so3_exp(0.4 * vector()) * base.rotation(), base.translation()};
}

}  // namespace hm
