#include "hm/odometry/registration/surface_grid.hpp"

#include <Eigen/Dense>
#include <array>
#include <cmath>

namespace hm {
namespace {

constexpr int kHalfWindow = 2;
constexpr int kMinReadings = 12;
constexpr float kSameSurfaceSigmas = 6.0f;

/// Mean of those of four readings that are close to the first valid one.
float mean_of_agreeing(const std::array<std::uint16_t, 4>& readings, float unit_m, const DepthNoise& noise) {
  float first = 0;
  for (const std::uint16_t reading : readings) {
    if (reading == 0) continue;
    first = static_cast<float>(reading) * unit_m;
    break;
  }
  if (first == 0) return 0;
  const float gate = kSameSurfaceSigmas * static_cast<float>(noise.sigma_m(static_cast<double>(first)));
  float sum = 0, count = 0;
  for (const std::uint16_t reading : readings) {
    const float z = static_cast<float>(reading) * unit_m;
    if (reading == 0 || std::abs(z - first) > gate) continue;
    sum += z;
    count += 1;
  }
  // A single reading whose neighbours differ or are missing lies at an edge.
  return count >= 2 ? sum / count : 0;
}

/// Sums of the least-squares fit of w = a u + b v + c over a window, u and v relative to its centre.
struct PlaneSums {
  float n = 0, u = 0, v = 0, uu = 0, uv = 0, vv = 0, w = 0, uw = 0, vw = 0, ww = 0;
  void add(float du, float dv, float value) {
    n += 1, u += du, v += dv, w += value;
    uu += du * du, uv += du * dv, vv += dv * dv;
    uw += du * value, vw += dv * value, ww += value * value;
  }
};

PlaneSums window_sums(const Image<float>& depth, int x, int y, float gate_m) {
  PlaneSums sums;
  const float z0 = depth(x, y);
  for (int dy = -kHalfWindow; dy <= kHalfWindow; ++dy)
    for (int dx = -kHalfWindow; dx <= kHalfWindow; ++dx) {
      const float z = depth(x + dx, y + dy);
      // The plane may be steep: the tolerance grows with the distance from the centre.
      const float reach = gate_m * static_cast<float>(1 + std::max(std::abs(dx), std::abs(dy)));
      if (z > 0 && std::abs(z - z0) < reach)
        sums.add(static_cast<float>(dx), static_cast<float>(dy), 1 / z - 1 / z0);
    }
  return sums;
}

SurfaceElement fit_element(const DepthGrid& grid, int x, int y, const DepthNoise& noise) {
  SurfaceElement element;
  const float z0 = grid.depth_m(x, y);
  if (!(z0 > 0)) return element;
  const float sigma_z = static_cast<float>(noise.sigma_m(static_cast<double>(z0)));
  const float slope_m = 2.0f * z0 / static_cast<float>(grid.camera.fx);
  const PlaneSums s = window_sums(grid.depth_m, x, y, 2 * sigma_z + slope_m);
  if (s.n < kMinReadings) return element;
  Eigen::Matrix3f normal_matrix;
  normal_matrix << s.uu, s.uv, s.u, s.uv, s.vv, s.v, s.u, s.v, s.n;
  const Eigen::Vector3f rhs(s.uw, s.vw, s.w);
  const float determinant = normal_matrix.determinant();
  if (!(determinant > 1.0f)) return element;
  const Eigen::Vector3f abc = normal_matrix.inverse() * rhs;
  const float rms_w = std::sqrt(std::max(0.0f, (s.ww - abc.dot(rhs)) / s.n));
  if (rms_w * z0 * z0 > 3 * sigma_z) return element;  // not a plane
  const auto& camera = grid.camera;
  const float inverse_z = 1 / z0 + abc.z();
  if (!(inverse_z > 0)) return element;
  const float z = 1 / inverse_z;
  const float fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const float a = (static_cast<float>(x) - static_cast<float>(camera.cx)) / fx;
  const float b = (static_cast<float>(y) - static_cast<float>(camera.cy)) / fy;
  element.point = Eigen::Vector3f(a, b, 1) * z;
  // 1/z = A X/Z + B Y/Z + C is the plane A X + B Y + C Z = 1.
  Eigen::Vector3f plane(abc.x() * fx, abc.y() * fy, 0);
  plane.z() = inverse_z - plane.x() * a - plane.y() * b;
  element.normal = -plane.normalized();
  const float cosine = -element.normal.dot(element.point.normalized());
  if (cosine < 0.2f) return element;  // grazing
  element.sigma_m = std::max(sigma_z, rms_w * z0 * z0) * std::abs(element.normal.z());
  return element;
}

}  // namespace

std::optional<GridReading> reading_at(const DepthGrid& grid, const Vec3& p_camera) {
  constexpr double kInFront_m = 0.05;
  if (p_camera.z() < kInFront_m) return std::nullopt;
  const Vec2 pixel = grid.camera.project(p_camera);
  const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
  if (!grid.depth_m.contains(x, y) || !(grid.depth_m(x, y) > 0)) return std::nullopt;
  return GridReading{Vec2(x, y), static_cast<double>(grid.depth_m(x, y))};
}

DepthGrid make_depth_grid(const DepthImage& depth, const PinholeCamera& camera, const DepthNoise& noise,
                          double max_depth_m) {
  DepthGrid grid;
  grid.camera = camera.scaled(1.0 / DepthGrid::kCell_px);
  grid.depth_m = Image<float>(depth.width() / DepthGrid::kCell_px, depth.height() / DepthGrid::kCell_px);
  grid.camera.width = grid.depth_m.width();
  grid.camera.height = grid.depth_m.height();
  const float unit_m = static_cast<float>(depth.unit_m);
  for (int y = 0; y < grid.depth_m.height(); ++y) {
    const auto upper = depth.units.row(DepthGrid::kCell_px * y + 1);
    const auto lower = depth.units.row(DepthGrid::kCell_px * y + 2);
    for (int x = 0; x < grid.depth_m.width(); ++x) {
      const auto at = static_cast<std::size_t>(DepthGrid::kCell_px * x + 1);
      const float z = mean_of_agreeing({upper[at], upper[at + 1], lower[at], lower[at + 1]}, unit_m, noise);
      grid.depth_m(x, y) = z <= static_cast<float>(max_depth_m) ? z : 0;
    }
  }
  return grid;
}

SurfaceGrid make_surface_grid(const DepthGrid& grid, const DepthNoise& noise) {
  SurfaceGrid surface;
  surface.camera = grid.camera;
  surface.elements = Image<SurfaceElement>(grid.depth_m.width(), grid.depth_m.height());
  for (int y = kHalfWindow; y < grid.depth_m.height() - kHalfWindow; ++y)
    for (int x = kHalfWindow; x < grid.depth_m.width() - kHalfWindow; ++x)
      surface.elements(x, y) = fit_element(grid, x, y, noise);
  return surface;
}

std::vector<SurfaceElement> sample_surface(const DepthGrid& grid, const DepthNoise& noise, int stride) {
  std::vector<SurfaceElement> elements;
  for (int y = kHalfWindow; y < grid.depth_m.height() - kHalfWindow; y += stride)
    for (int x = kHalfWindow; x < grid.depth_m.width() - kHalfWindow; x += stride)
      if (const SurfaceElement element = fit_element(grid, x, y, noise); element.sigma_m > 0)
        elements.push_back(element);
  return elements;
}

}  // namespace hm
