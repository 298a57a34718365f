#include "hm/pipeline/pose_agreement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/core/statistics.hpp"

namespace hm {
namespace {

constexpr int kPixelStep = 8;
/// Fewer points than this say nothing.
constexpr std::size_t kMinPoints = 50;
constexpr double kMinOverlap = 0.1;

SE3 motion_between(const FramePair& pair, const ReadingHypothesis& hypothesis) {
  if (hypothesis.poses_ignored) return {};
  const SE3 &from = *pair.from.T_world_camera, &to = *pair.to.T_world_camera;
  return hypothesis.poses_inverted ? to * from.inverse() : to.inverse() * from;
}

}  // namespace

std::string to_string(const ReadingHypothesis& hypothesis) {
  std::string text;
  const auto add = [&](std::string_view part) {
    if (!text.empty()) text += ", ";
    text += part;
  };
  if (hypothesis.poses_ignored) add("poses ignored");
  if (hypothesis.poses_inverted) add("poses inverted");
  if (hypothesis.fy_flipped) add("-fy");
  if (hypothesis.depth_factor != 1.0) add(fmt::format("depth x {}", hypothesis.depth_factor));
  return text.empty() ? "as given" : text;
}

Agreement compare(const FramePair& pair, const PinholeCamera& given, const ReadingHypothesis& hypothesis) {
  PinholeCamera camera = given;
  if (hypothesis.fy_flipped) camera.fy = -camera.fy;
  const SE3 T_to_from = motion_between(pair, hypothesis);
  std::vector<double> errors, relative;
  std::size_t moved = 0;
  for (int y = kPixelStep / 2; y < camera.height; y += kPixelStep) {
    for (int x = kPixelStep / 2; x < camera.width; x += kPixelStep) {
      const double z_from = pair.from.depth.depth_m(x, y) * hypothesis.depth_factor;
      if (z_from <= 0) continue;
      ++moved;
      const Vec3 p_to = T_to_from * camera.unproject(Vec2(x, y), z_from);
      if (p_to.z() <= 1e-3 * z_from) continue;
      const Vec2 pixel = camera.project(p_to);
      if (!camera.contains(pixel)) continue;
      const int u = std::clamp(static_cast<int>(std::floor(pixel.x() + 0.5)), 0, camera.width - 1);
      const int v = std::clamp(static_cast<int>(std::floor(pixel.y() + 0.5)), 0, camera.height - 1);
      const double z_to = pair.to.depth.depth_m(u, v) * hypothesis.depth_factor;
      if (z_to <= 0) continue;
      errors.push_back(std::fabs(p_to.z() - z_to));
      relative.push_back(errors.back() / z_to);
    }
  }
  Agreement result;
  if (moved > 0) result.overlap_ratio = static_cast<double>(errors.size()) / static_cast<double>(moved);
  if (errors.size() < kMinPoints || result.overlap_ratio < kMinOverlap) return result;
  result.median_m = quantile(std::move(errors), 0.5);
  result.relative = quantile(std::move(relative), 0.5);
  return result;
}

Agreement compare(const std::vector<FramePair>& pairs, const PinholeCamera& camera,
                  const ReadingHypothesis& hypothesis) {
  std::vector<double> medians, relative, overlaps;
  for (const FramePair& pair : pairs) {
    const Agreement one = compare(pair, camera, hypothesis);
    medians.push_back(one.median_m);
    relative.push_back(one.relative);
    overlaps.push_back(one.overlap_ratio);
  }
  if (pairs.empty()) return {};
  return {quantile(medians, 0.5), quantile(relative, 0.5), quantile(overlaps, 0.5)};
}

std::vector<ReadingHypothesis> reading_hypotheses() {
  constexpr std::array<double, 10> kFactors{0.001, 0.01, 0.1, 0.2, 0.5, 2, 5, 10, 100, 1000};
  std::vector<ReadingHypothesis> all{{}, {.poses_ignored = true}};
  for (const bool inverted : {false, true})
    for (const bool flipped : {false, true}) {
      if (inverted || flipped) all.push_back({.poses_inverted = inverted, .fy_flipped = flipped});
      if (inverted && flipped) continue;
      for (const double factor : kFactors)
        all.push_back({.poses_inverted = inverted, .fy_flipped = flipped, .depth_factor = factor});
    }
  std::ranges::stable_sort(all.begin() + 2, all.end(), {}, &ReadingHypothesis::changes);
  return all;
}

}  // namespace hm
