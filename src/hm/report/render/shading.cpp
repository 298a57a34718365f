#include "hm/report/render/shading.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace hm {
namespace {

constexpr double kReach_m = 0.6;  // of ambient occlusion
constexpr int kTaps = 16;

/// Tap directions and radii in a spiral, turned differently at each pixel of a 4 x 4 tile.
class TapOffsets {
 public:
  TapOffsets() {
    constexpr double kGoldenAngle = 2.39996322972865332;
    constexpr std::array<int, kPixels> kOrder{0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};
    for (std::size_t pixel = 0; pixel < kPixels; ++pixel)
      for (int tap = 0; tap < kTaps; ++tap) {
        const double turn = 2 * M_PI / kTaps * kOrder[pixel] / 16.0 * 5;
        const double radius = std::pow((tap + 0.5) / kTaps, 0.75);
        const double angle = kGoldenAngle * tap + turn;
        of_pixel_[pixel][static_cast<std::size_t>(tap)] = {radius * std::cos(angle),
                                                           radius * std::sin(angle)};
      }
  }
  /// Taps of a pixel, in units of the reach.
  [[nodiscard]] const std::array<Vec2, kTaps>& at(int x, int y) const {
    return of_pixel_[static_cast<std::size_t>((y & 3) * 4 + (x & 3))];
  }

 private:
  static constexpr std::size_t kPixels = 16;
  std::array<std::array<Vec2, kTaps>, kPixels> of_pixel_;
};

double free_share(const Vec3& p, const Vec3& normal, const Vec3& other) {
  const Vec3 offset = other - p;
  const double distance = offset.norm();
  if (distance < 1e-6 || distance > kReach_m) return 1;
  const double cosine = std::max(0.0, normal.dot(offset) / distance - 0.12);
  const double fade = 1 - distance / kReach_m;
  return 1 - 1.6 * cosine * fade;
}

/// Outline factor, below 1 at depth discontinuities: the second difference of nearness, 0 on any plane, is
/// large on the nearer side. Separates surfaces of equal brightness.
float outline(const VisibilityBuffer& buffer, int x, int y) {
  const int sx = 2 * x, sy = 2 * y;
  const float here = buffer.nearness(sx, sy);
  float strongest = 0;
  for (const auto& [dx, dy] : {std::pair{2, 0}, std::pair{0, 2}}) {
    if (!buffer.nearness.contains(sx - dx, sy - dy) || !buffer.nearness.contains(sx + dx, sy + dy)) continue;
    if (!buffer.hit(sx - dx, sy - dy) || !buffer.hit(sx + dx, sy + dy)) continue;
    const float bend = 2 * here - buffer.nearness(sx - dx, sy - dy) - buffer.nearness(sx + dx, sy + dy);
    strongest = std::max(strongest, bend / std::abs(here));
  }
  return 1 - 0.38F * std::clamp((strongest - 0.004F) / 0.008F, 0.F, 1.F);
}

/// Pixel of the image, with 2 x 2 samples of the buffer.
struct Pixel {
  int x = 0, y = 0;
};

/// The first sample of each pixel: a quarter of what the taps, which are spread over the image, read from
/// memory.
Image<float> nearness_of_pixels(const VisibilityBuffer& buffer) {
  Image<float> nearness(buffer.nearness.width() / 2, buffer.nearness.height() / 2);
  for (int y = 0; y < nearness.height(); ++y)
    for (int x = 0; x < nearness.width(); ++x) nearness(x, y) = buffer.nearness(2 * x, 2 * y);
  return nearness;
}

/// Share of the hemisphere above a surface that is not occluded near this pixel, 0 to 1.
double open_share(const SurfaceSample& here, const Image<float>& nearness, const ViewProjection& projection,
                  const TapOffsets& taps, const Pixel& pixel) {
  const auto own_nearness = static_cast<double>(nearness(pixel.x, pixel.y));
  const double reach_px = 0.5 * std::min(400.0, kReach_m * projection.samples_per_m(own_nearness));
  double light = 0;
  for (const Vec2& tap : taps.at(pixel.x, pixel.y)) {
    const int x = pixel.x + static_cast<int>(std::lround(reach_px * tap.x()));
    const int y = pixel.y + static_cast<int>(std::lround(reach_px * tap.y()));
    if (!nearness.contains(x, y) || nearness(x, y) == std::numeric_limits<float>::lowest()) {
      light += 1;
      continue;
    }
    const auto there = static_cast<double>(nearness(x, y));
    light += free_share(here.p_world, here.normal, projection.unproject(2 * x, 2 * y, there));
  }
  return std::max(0.0, light / kTaps);
}

/// Mean over the 4 x 4 tile around a pixel, of samples at similar depth; removes the pattern of the taps.
float tile_mean(const Image<float>& raw, const VisibilityBuffer& buffer, const Pixel& pixel) {
  const float here = buffer.nearness(2 * pixel.x, 2 * pixel.y);
  const float tolerance = 0.02F * std::abs(here);
  float sum = 0, weight = 0;
  for (int ty = std::max(0, pixel.y - 2); ty < std::min(raw.height(), pixel.y + 2); ++ty)
    for (int tx = std::max(0, pixel.x - 2); tx < std::min(raw.width(), pixel.x + 2); ++tx) {
      if (!buffer.hit(2 * tx, 2 * ty) || std::abs(buffer.nearness(2 * tx, 2 * ty) - here) > tolerance)
        continue;
      sum += raw(tx, ty);
      weight += 1;
    }
  return weight > 0 ? sum / weight : raw(pixel.x, pixel.y);
}

}  // namespace

SurfaceSample surface_sample(const TriangleMesh& mesh, const VisibilityBuffer& buffer,
                             const ViewProjection& projection, const Vec2& sample) {
  const int x = static_cast<int>(sample.x()), y = static_cast<int>(sample.y());
  SurfaceSample out;
  out.triangle = buffer.triangle(x, y);
  out.p_world = projection.unproject(x, y, static_cast<double>(buffer.nearness(x, y)));
  const auto& t = mesh.triangles[out.triangle];
  const Vec3 a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
             c = mesh.vertices[t[2]].cast<double>();
  out.weights = barycentric(out.p_world, a, b, c);
  const Vec3 viewer = projection.towards_viewer(out.p_world);
  const Vec3 face_normal = (b - a).cross(c - a).normalized();
  out.seen_from_behind = face_normal.dot(viewer) < 0;
  out.normal = face_normal;
  if (mesh.has_normals()) {
    const Vec3 smooth = out.weights.x() * mesh.normals[t[0]].cast<double>() +
                        out.weights.y() * mesh.normals[t[1]].cast<double>() +
                        out.weights.z() * mesh.normals[t[2]].cast<double>();
    if (smooth.allFinite() && smooth.norm() > 1e-6) out.normal = smooth.normalized();
    if (out.normal.dot(face_normal) < 0) out.normal = -out.normal;
  }
  if (out.seen_from_behind) out.normal = -out.normal;
  return out;
}

Image<float> ambient_light(const TriangleMesh& mesh, const VisibilityBuffer& buffer,
                           const ViewProjection& projection, const ParallelLoop& loop) {
  const int width = buffer.triangle.width() / 2, height = buffer.triangle.height() / 2;
  Image<float> raw(width, height, 1.F), smooth(width, height, 1.F);
  const auto for_seen_pixels = [&](const auto& body) {
    loop.for_ranges(static_cast<std::size_t>(height), 8, [&](std::size_t begin, std::size_t end) {
      for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
        for (int x = 0; x < width; ++x)
          if (buffer.hit(2 * x, 2 * y)) body(Pixel{x, y});
    });
  };
  const TapOffsets taps;
  const Image<float> nearness = nearness_of_pixels(buffer);
  for_seen_pixels([&](const Pixel& p) {
    const SurfaceSample here = surface_sample(mesh, buffer, projection, Vec2(2 * p.x, 2 * p.y));
    raw(p.x, p.y) = static_cast<float>(open_share(here, nearness, projection, taps, p));
  });
  for_seen_pixels(
      [&](const Pixel& p) { smooth(p.x, p.y) = tile_mean(raw, buffer, p) * outline(buffer, p.x, p.y); });
  return smooth;
}

double brightness(const SurfaceSample& sample, const Vec3& towards_viewer, const Vec3& up) {
  const Vec3 left = towards_viewer.cross(up);  // zero when seen from straight above
  const Vec3 key = (0.6 * left + 0.75 * up + 0.35 * towards_viewer).normalized();
  const double headlight = std::max(0.0, sample.normal.dot(towards_viewer));
  const double sky = 0.5 + 0.5 * sample.normal.dot(up);
  const double side = std::max(0.0, sample.normal.dot(key));
  return 0.32 + 0.26 * headlight + 0.14 * sky + 0.26 * side;
}

}  // namespace hm
