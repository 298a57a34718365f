// The procedural patterns behind albedo(): cheap functions of a position in the plane of the surface.
#include <algorithm>
#include <cmath>

#include "hm/sim/world/material.hpp"

namespace hm {
namespace {

using Color = Eigen::Vector3f;

std::uint32_t hash(int x, int y, std::uint32_t seed) {
  std::uint32_t h = seed ^ (static_cast<std::uint32_t>(x) * 0x9e3779b1u);
  h = (h ^ (h >> 15u)) * 0x85ebca77u;
  h ^= static_cast<std::uint32_t>(y) * 0xc2b2ae3du;
  h = (h ^ (h >> 13u)) * 0x27d4eb2fu;
  return h ^ (h >> 16u);
}

float hash01(int x, int y, std::uint32_t seed) {
  return static_cast<float>(hash(x, y, seed) >> 8u) * (1.0f / 16777216.0f);
}

int floor_int(float v) {
  const int i = static_cast<int>(v);
  return i - (v < static_cast<float>(i) ? 1 : 0);
}

/// Value noise in [0, 1], one value per unit cell, smoothly interpolated.
float noise(float u, float v, std::uint32_t seed) {
  const int i = floor_int(u), j = floor_int(v);
  const float a = u - static_cast<float>(i), b = v - static_cast<float>(j);
  const float sa = a * a * (3.0f - 2.0f * a), sb = b * b * (3.0f - 2.0f * b);
  const float low = hash01(i, j, seed) * (1 - sa) + hash01(i + 1, j, seed) * sa;
  const float high = hash01(i, j + 1, seed) * (1 - sa) + hash01(i + 1, j + 1, seed) * sa;
  return low * (1 - sb) + high * sb;
}

Color to_color(Rgb8 c) {
  return Color(static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b)) / 255.0f;
}

/// Material and surface point for evaluating a pattern.
struct Spot {
  float u = 0, v = 0;  ///< metres in the plane of the surface; v is up on walls
  float scale = 1;
  Color base, accent;
  std::uint32_t seed = 0;
};

Color mix(const Color& a, const Color& b, float t) { return a + (b - a) * t; }

Color plain(const Spot& s) {
  const float grain = noise(s.u * 60, s.v * 60, s.seed) * 0.5f + noise(s.u * 9, s.v * 9, s.seed + 1) * 0.5f;
  return s.base * (0.93f + 0.12f * (grain - 0.5f));
}

Color planks(const Spot& s) {
  const float width = s.scale;
  const int row = floor_int(s.v / width);
  const float along = s.u / (9 * width) + hash01(row, 0, s.seed);
  const int board = floor_int(along);
  const float across = s.v / width - static_cast<float>(row);
  const float end = (along - static_cast<float>(board)) * 9;
  if (across < 0.035f || end < 0.03f) return s.accent * 0.5f;
  const float tone = hash01(row, board, s.seed + 7);
  const float grain = noise(s.u * 6, s.v * 110, s.seed + static_cast<std::uint32_t>(row));
  return mix(s.base, s.accent, 0.55f * tone + 0.35f * grain);
}

Color tiles(const Spot& s) {
  const float tu = s.u / s.scale, tv = s.v / s.scale;
  const int i = floor_int(tu), j = floor_int(tv);
  const float a = tu - static_cast<float>(i), b = tv - static_cast<float>(j);
  const float grout = 0.006f / s.scale;
  if (a < grout || b < grout) return s.accent;
  const float tone = 0.86f + 0.14f * hash01(i, j, s.seed);
  return s.base * (tone * (0.94f + 0.06f * noise(s.u * 25, s.v * 25, s.seed)));
}

Color wallpaper(const Spot& s) {
  const float tu = s.u / s.scale, tv = s.v / s.scale;
  const int i = floor_int(tu), j = floor_int(tv + (i & 1 ? 0.5f : 0.0f));
  const float a = tu - static_cast<float>(i) - 0.5f;
  const float b = tv + (i & 1 ? 0.5f : 0.0f) - static_cast<float>(j) - 0.5f;
  const float paper = 0.95f + 0.08f * (noise(s.u * 40, s.v * 40, s.seed) - 0.5f);
  const float radius = 0.16f + 0.1f * hash01(i, j, s.seed);
  const bool motif = std::abs(a) + std::abs(b) * 0.7f < radius;
  const bool stripe = std::abs(a) > 0.47f;
  const float weight = motif ? 0.35f + 0.5f * hash01(i, j, s.seed + 3) : (stripe ? 0.45f : 0.0f);
  return mix(s.base, s.accent, weight) * paper;
}

Color woodgrain(const Spot& s) {
  const float wave = noise(s.u * 3, s.v * 3, s.seed) * 0.04f;
  const float grain = noise((s.u + wave) * 90, (s.v + wave) * 7, s.seed + 1);
  const float knots = noise(s.u * 11, s.v * 11, s.seed + 2);
  return mix(s.base, s.accent, std::clamp(0.65f * grain + 0.5f * (knots - 0.5f), 0.0f, 1.0f));
}

Color fabric(const Spot& s) {
  const int i = floor_int(s.u / s.scale), j = floor_int(s.v / s.scale);
  const float weave = hash01(floor_int(s.u * 170), floor_int(s.v * 170), s.seed);
  const float check = 0.3f * static_cast<float>((i & 1) + (j & 1));
  return mix(s.base, s.accent, check) * (0.86f + 0.2f * weave);
}

Color stone(const Spot& s) {
  const float a = noise(s.u / s.scale, s.v / s.scale, s.seed);
  const float vein = std::abs(noise(s.u * 4 / s.scale, s.v * 4 / s.scale, s.seed + 1) - 0.5f);
  const float speck = hash01(floor_int(s.u * 140), floor_int(s.v * 140), s.seed + 2);
  return mix(s.base, s.accent,
             std::clamp(0.4f * a + (vein < 0.06f ? 0.4f : 0.0f) + 0.3f * speck, 0.0f, 1.0f));
}

Color books(const Spot& s) {
  const int book = floor_int(s.u / s.scale);
  const float a = s.u / s.scale - static_cast<float>(book);
  if (a < 0.07f) return Color(0.08f, 0.07f, 0.06f);
  const Color cloth(0.2f + 0.65f * hash01(book, 1, s.seed), 0.15f + 0.5f * hash01(book, 2, s.seed),
                    0.15f + 0.5f * hash01(book, 3, s.seed));
  const float band = s.v * 14 + hash01(book, 4, s.seed);
  const bool title = band - static_cast<float>(floor_int(band)) < 0.2f;
  return title ? mix(cloth, Color(0.95f, 0.85f, 0.55f), 0.7f) : cloth;
}

Color painting(const Spot& s) {
  const float u = s.u / s.scale, v = s.v / s.scale;
  const float warp = 2 * noise(u * 2, v * 2, s.seed);
  const float a = noise(u * 3 + warp, v * 3, s.seed + 1), b = noise(u * 5, v * 5 + warp, s.seed + 2);
  const float c = noise(u * 2 - warp, v * 4, s.seed + 3);
  const Color paint = mix(mix(s.base, s.accent, a), Color(b, c, 1 - a), 0.5f);
  return paint * (b > 0.62f ? 1.1f : 0.8f + 0.2f * noise(s.u * 120, s.v * 120, s.seed));
}

Color leaves(const Spot& s) {
  const float a = noise(s.u * 25, s.v * 25, s.seed), b = noise(s.u * 90, s.v * 90, s.seed);
  return mix(s.base, s.accent, 0.6f * a + 0.4f * b);
}

Color sky(const Spot& s) {
  const float cloud = noise(s.u * 2, s.v * 3, s.seed) * 0.6f + noise(s.u * 6, s.v * 8, s.seed) * 0.4f;
  const float horizon = std::clamp((1.35f - s.v) * 4, 0.0f, 1.0f);
  return mix(mix(s.base, s.accent, std::clamp(cloud * 1.6f - 0.4f, 0.0f, 1.0f)), Color(0.35f, 0.5f, 0.28f),
             horizon * (0.6f + 0.3f * cloud));
}

}  // namespace

Eigen::Vector3f albedo(const Material& material, const Eigen::Vector3f& p_world,
                       const Eigen::Vector3f& normal) {
  const float ax = std::abs(normal.x()), ay = std::abs(normal.y()), az = std::abs(normal.z());
  Spot s;
  if (az >= ax && az >= ay) {
    s.u = p_world.x(), s.v = p_world.y();
  } else {
    s.u = ax > ay ? p_world.y() : p_world.x(), s.v = p_world.z();
  }
  s.scale = material.scale_m;
  s.base = to_color(material.base);
  s.accent = to_color(material.accent);
  s.seed = hash(material.base.r * 256 + material.base.g, material.accent.r * 256 + material.base.b, 17);
  switch (material.pattern) {
    case Pattern::kPlain:
      return plain(s);
    case Pattern::kPlanks:
      return planks(s);
    case Pattern::kTiles:
      return tiles(s);
    case Pattern::kWallpaper:
      return wallpaper(s);
    case Pattern::kWoodgrain:
      return woodgrain(s);
    case Pattern::kFabric:
      return fabric(s);
    case Pattern::kStone:
      return stone(s);
    case Pattern::kBooks:
      return books(s);
    case Pattern::kPainting:
      return painting(s);
    case Pattern::kLeaves:
      return leaves(s);
    case Pattern::kSky:
      return sky(s);
  }
  return s.base;
}

}  // namespace hm
