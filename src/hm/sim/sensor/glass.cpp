#include "hm/sim/sensor/glass.hpp"

#include <cmath>

namespace hm {
namespace {

constexpr double kReflectance = 0.08;  ///< of both surfaces of a pane, at normal incidence

Rgb8 mixed(Rgb8 a, Rgb8 b, double share_of_b) {
  const auto channel = [&](std::uint8_t of_a, std::uint8_t of_b) {
    return static_cast<std::uint8_t>((1 - share_of_b) * of_a + share_of_b * of_b + 0.5);
  };
  return {channel(a.r, b.r), channel(a.g, b.g), channel(a.b, b.b)};
}

/// First surface that is not clear, on a ray from a pane.
RayHit beyond_panes(const World& world, const Renderer& renderer, Ray ray) {
  RayHit hit;
  renderer.cast({&ray, 1}, {&hit, 1});
  while (hit.is_hit() && world.parts[hit.part].material.clear) {
    ray.near_m = std::max(ray.near_m, hit.range_m) + 1e-4;
    renderer.cast({&ray, 1}, {&hit, 1});
  }
  return hit;
}

}  // namespace

void look_through_glass(const World& world, const Renderer& renderer, const PinholeCamera& camera,
                        std::span<const SE3> T_world_camera, double through_rad, RenderedView& view) {
  const double least_cosine = std::cos(through_rad);
  for (int y = 0; y < camera.height; ++y) {
    const SE3& pose = T_world_camera[static_cast<std::size_t>(y)];
    for (int x = 0; x < camera.width; ++x) {
      const std::uint16_t part = view.part(x, y);
      if (part == RenderedView::kNoPart || !world.parts[part].material.clear) continue;
      const Vec3 d((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1);
      const double length = d.norm(), z = static_cast<double>(view.depth_m(x, y));
      const Vec3 along = pose.rotation() * d / length, normal = view.normal(x, y).cast<double>();
      const Ray through{pose * (z * d), along, 1e-4};
      const Ray back{through.origin_world, along - 2 * along.dot(normal) * normal, 1e-4};
      const double cosine = static_cast<double>(view.cos_incidence(x, y));
      const double reflected = kReflectance + (1 - kReflectance) * std::pow(1 - cosine, 5);
      const RayHit behind = beyond_panes(world, renderer, through),
                   mirrored = beyond_panes(world, renderer, back);
      Rgb8 color = view.color(x, y);
      if (behind.is_hit()) color = mixed(color, renderer.color(through, behind), 0.8);
      if (mirrored.is_hit()) color = mixed(color, renderer.color(back, mirrored), reflected);
      view.color(x, y) = color;
      if (!behind.is_hit() || cosine < least_cosine) continue;
      view.depth_m(x, y) = static_cast<float>(z + behind.range_m / length);
      view.cos_incidence(x, y) = static_cast<float>(std::abs(behind.normal_world.dot(along)));
      view.part(x, y) = behind.part;
      view.normal(x, y) = behind.normal_world.cast<float>();
    }
  }
}

}  // namespace hm
