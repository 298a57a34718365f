#include "hm/pipeline/checks/image_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "hm/geometry/image.hpp"

namespace hm {
namespace {

constexpr int kSmallWidth =
    80;  ///< of the images that are compared: blurred so far that the steps below suffice
constexpr int kReach_px = 12;  ///< of the search, in their pixels
constexpr int kAround_px = 4;  ///< what is brighter than the mean around it by so many pixels is seen
constexpr int kTurns = 8;
constexpr double kTurnStep_rad = 1.5 * std::numbers::pi / 180;
constexpr std::size_t kMinSeenPoints = 200;

/// Mean brightness of squares of `scale` pixels.
Image<float> small_gray(const Image<Rgb8>& color, int scale) {
  Image<float> gray(color.width() / scale, color.height() / scale, 0.0F);
  for (int y = 0; y < gray.height() * scale; ++y)
    for (int x = 0; x < gray.width() * scale; ++x) {
      const Rgb8& c = color(x, y);
      gray(x / scale, y / scale) += static_cast<float>(c.r + 2 * c.g + c.b);
    }
  return gray;
}

/// Without what changes slowly over the image: shading towards its corners and a lamp beside the camera move
/// with the camera.
Image<float> without_shading(const Image<float>& gray) {
  Image<float> result(gray.width(), gray.height());
  for (int y = 0; y < gray.height(); ++y)
    for (int x = 0; x < gray.width(); ++x) {
      float sum = 0;
      int count = 0;
      for (int v = std::max(0, y - kAround_px); v <= std::min(gray.height() - 1, y + kAround_px); ++v)
        for (int u = std::max(0, x - kAround_px); u <= std::min(gray.width() - 1, x + kAround_px); ++u)
          sum += gray(u, v), ++count;
      result(x, y) = gray(x, y) - sum / static_cast<float>(count);
    }
  return result;
}

/// A point of the first image: its brightness, and where the second camera should see it.
struct SeenPoint {
  float brightness = 0;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  ///< of the small image, from its middle
};

std::vector<SeenPoint> points_of(const RgbdFrame& from, const RgbdFrame& to, const PinholeCamera& camera,
                                 int scale) {
  const SE3 T_to_from = to.T_world_camera->inverse() * *from.T_world_camera;
  const Image<float> gray = without_shading(small_gray(from.color, scale));
  std::vector<SeenPoint> points;
  for (int y = 0; y < gray.height(); y += 2)
    for (int x = 0; x < gray.width(); x += 2) {
      const Vec2 pixel((x + 0.5) * scale - 0.5, (y + 0.5) * scale - 0.5);
      const double depth_m =
          from.depth.depth_m(static_cast<int>(pixel.x() + 0.5), static_cast<int>(pixel.y() + 0.5));
      if (depth_m <= 0) continue;
      const Vec3 p_to = T_to_from * camera.unproject(pixel, depth_m);
      if (p_to.z() <= 0) continue;
      const Vec2 seen = (camera.project(p_to) - Vec2(camera.cx, camera.cy)) / scale;
      points.push_back({gray(x, y), seen.cast<float>()});
    }
  return points;
}

/// Correlation of the points' brightness with the image's, where they lie after a motion; none where less
/// than `least` of them lie in it.
std::optional<double> likeness(const std::vector<SeenPoint>& points, const Image<float>& gray,
                               const Eigen::Vector2f& middle, double turn_rad, const Eigen::Vector2f& shift,
                               std::size_t least) {
  const auto c = static_cast<float>(std::cos(turn_rad)), s = static_cast<float>(std::sin(turn_rad));
  double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  for (const SeenPoint& point : points) {
    const float u = c * point.pixel.x() - s * point.pixel.y() + shift.x() + middle.x();
    const float v = s * point.pixel.x() + c * point.pixel.y() + shift.y() + middle.y();
    if (!(std::abs(u) < 1e6F && std::abs(v) < 1e6F)) continue;
    const int x = static_cast<int>(std::lrint(u)), y = static_cast<int>(std::lrint(v));
    if (!gray.contains(x, y)) continue;
    const auto first = static_cast<double>(point.brightness), second = static_cast<double>(gray(x, y));
    n += 1, a += first, b += second, aa += first * first, bb += second * second, ab += first * second;
  }
  if (n < static_cast<double>(least)) return std::nullopt;
  const double spread = (n * aa - a * a) * (n * bb - b * b);
  return spread > 0 ? (n * ab - a * b) / std::sqrt(spread) : 0;
}

}  // namespace

double ImageMotion::angle_rad(const PinholeCamera& camera) const {
  return std::max(std::abs(turn_rad), shift_px.norm() / camera.fx);
}

std::optional<ImageMotion> image_motion(const RgbdFrame& from, const RgbdFrame& to,
                                        const PinholeCamera& camera) {
  const auto fits = [&](const auto& image) {
    return image.width() == camera.width && image.height() == camera.height;
  };
  if (!fits(from.color) || !fits(to.color) || !fits(from.depth)) return std::nullopt;
  const int scale = (camera.width + kSmallWidth - 1) / kSmallWidth;
  const std::vector<SeenPoint> points = points_of(from, to, camera, scale);
  const Image<float> gray = without_shading(small_gray(to.color, scale));
  const Eigen::Vector2f middle =
      ((Vec2(camera.cx, camera.cy) + Vec2(0.5, 0.5)) / scale - Vec2(0.5, 0.5)).cast<float>();
  const std::size_t least = std::max(kMinSeenPoints, points.size() / 2);
  const auto unmoved = likeness(points, gray, middle, 0, Eigen::Vector2f::Zero(), least);
  if (!unmoved) return std::nullopt;
  ImageMotion best{0, Vec2::Zero(), *unmoved, *unmoved};
  for (int turn = -kTurns; turn <= kTurns; ++turn)
    for (int right = -kReach_px; right <= kReach_px; ++right)
      for (int down = -kReach_px; down <= kReach_px; ++down) {
        const Vec2 shift(right, down);
        const auto found = likeness(points, gray, middle, turn * kTurnStep_rad, shift.cast<float>(), least);
        if (found && *found > best.likeness) best = {turn * kTurnStep_rad, scale * shift, *found, *unmoved};
      }
  return best;
}

}  // namespace hm
