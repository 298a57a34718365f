#include "hm/pipeline/checks/pose_agreement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hm/core/statistics.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

constexpr int kPixelStep = 6;
constexpr int kTile_px = 80;
/// Fewer points than this are not compared.
constexpr std::size_t kMinPoints = 50;
constexpr double kMinOverlap = 0.1;
/// A point lies on what the other view measured within this distance, which grows with depth (noise, edges).
constexpr double kTolerance_m = 0.08, kToleranceRatio = 0.04;

/// The pose whose quaternion qw qx qy qz was read as qx qy qz qw. Interpolation between two does not depend
/// on the order.
SE3 in_other_order(const SE3& pose) {
  const Eigen::Quaterniond& q = pose.quaternion();
  return {Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()), pose.translation()};
}

SE3 motion_between(const SE3& from, const SE3& to, const ReadingHypothesis& hypothesis) {
  if (hypothesis.poses_ignored) return {};
  if (hypothesis.real_part_first) return in_other_order(to).inverse() * in_other_order(from);
  return hypothesis.poses_inverted ? to * from.inverse() : to.inverse() * from;
}

/// Means of relative differences by tile of the image.
class TileMeans {
 public:
  explicit TileMeans(const PinholeCamera& camera)
      : columns_((camera.width + kTile_px - 1) / kTile_px),
        tiles_(static_cast<std::size_t>(columns_ * ((camera.height + kTile_px - 1) / kTile_px))) {}

  void add(int u, int v, double difference) {
    // Clipped, not dropped: borders of things must not rule a tile, and a wrong reading must not gain.
    constexpr double kClip_ratio = 0.1;
    Tile& tile = tiles_[static_cast<std::size_t>((v / kTile_px) * columns_ + u / kTile_px)];
    tile.sum += std::clamp(difference, -kClip_ratio, kClip_ratio);
    ++tile.count;
  }

  /// Slope of the means over the image by least squares, per radian: a turn about an axis in the image plane
  /// brings one side nearer and the other farther, by its angle.
  [[nodiscard]] double slope_rad(const PinholeCamera& camera) const {
    Mat3 normal = Mat3::Zero();
    Vec3 right = Vec3::Zero();
    for (std::size_t i = 0; i < tiles_.size(); ++i) {
      const Tile& tile = tiles_[i];
      if (tile.count < kMinCount) continue;
      const int column = static_cast<int>(i) % columns_, row = static_cast<int>(i) / columns_;
      const Vec3 place(1, (column * kTile_px + kTile_px / 2 - camera.cx) / camera.fx,
                       (row * kTile_px + kTile_px / 2 - camera.cy) / camera.fy);
      normal += tile.count * place * place.transpose();
      right += tile.sum * place;
    }
    const Vec3 plane = solve_symmetric_3(normal, right);
    return plane.allFinite() ? plane.tail<2>().norm() : 0;
  }

  /// Median of |mean| over the tiles that hold enough.
  [[nodiscard]] double median() const {
    std::vector<double> means;
    for (const Tile& tile : tiles_)
      if (tile.count >= kMinCount) means.push_back(std::fabs(tile.sum / tile.count));
    return means.empty() ? 1.0 : quantile(std::move(means), 0.5);
  }

 private:
  struct Tile {
    double sum = 0;
    int count = 0;
  };
  static constexpr int kMinCount = 20;
  int columns_;
  std::vector<Tile> tiles_;
};

/// Points that the other view could see: on what it measured, or in front of it.
struct VisibleCounts {
  std::size_t agree = 0, seen_through = 0;
  void add(double z_predicted, double z_measured) {
    const double behind = z_predicted - z_measured, tolerance = kTolerance_m + kToleranceRatio * z_measured;
    if (behind < -tolerance)
      ++seen_through;
    else if (behind <= tolerance)
      ++agree;
  }
  [[nodiscard]] double contradicted_ratio() const {
    const auto all = static_cast<double>(agree + seen_through);
    return all > 0 ? static_cast<double>(seen_through) / all : 0;
  }
};

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
  if (hypothesis.real_part_first) add("qw first");
  if (hypothesis.depth_factor != 1.0) add(fmt::format("depth x {}", hypothesis.depth_factor));
  return text.empty() ? "as given" : text;
}

Agreement compare(const RgbdFrame& from, const RgbdFrame& to, const PinholeCamera& given,
                  const ReadingHypothesis& hypothesis) {
  PinholeCamera camera = given;
  if (hypothesis.fy_flipped) camera.fy = -camera.fy;
  const SE3 T_to_from = motion_between(*from.T_world_camera, *to.T_world_camera, hypothesis);
  std::vector<double> errors, relative;
  TileMeans tiles(camera);
  VisibleCounts visible;
  std::size_t moved = 0;
  for (int y = kPixelStep / 2; y < camera.height; y += kPixelStep) {
    for (int x = kPixelStep / 2; x < camera.width; x += kPixelStep) {
      const double z_from = from.depth.depth_m(x, y) * hypothesis.depth_factor;
      if (z_from <= 0) continue;
      ++moved;
      const Vec3 p_to = T_to_from * camera.unproject(Vec2(x, y), z_from);
      if (p_to.z() <= 1e-3 * z_from) continue;
      const Vec2 pixel = camera.project(p_to);
      if (!camera.contains(pixel)) continue;
      const int u = std::clamp(static_cast<int>(std::floor(pixel.x() + 0.5)), 0, camera.width - 1);
      const int v = std::clamp(static_cast<int>(std::floor(pixel.y() + 0.5)), 0, camera.height - 1);
      const double z_to = to.depth.depth_m(u, v) * hypothesis.depth_factor;
      if (z_to <= 0) continue;
      errors.push_back(std::fabs(p_to.z() - z_to));
      relative.push_back(errors.back() / z_to);
      tiles.add(u, v, (p_to.z() - z_to) / z_to);
      visible.add(p_to.z(), z_to);
    }
  }
  Agreement result;
  if (moved > 0) result.overlap_ratio = static_cast<double>(errors.size()) / static_cast<double>(moved);
  if (errors.size() < kMinPoints || result.overlap_ratio < kMinOverlap) return result;
  result.median_m = middle_value(std::span(errors));
  result.relative = middle_value(std::span(relative));
  result.systematic = tiles.median();
  result.tilt_rad = tiles.slope_rad(camera);
  result.contradicted_ratio = visible.contradicted_ratio();
  return result;
}

std::vector<Agreement> compare_all(const std::vector<FramePair>& pairs, const PinholeCamera& camera,
                                   const ReadingHypothesis& hypothesis) {
  std::vector<Agreement> agreements;
  for (const FramePair& pair : pairs) agreements.push_back(compare(pair.from, pair.to, camera, hypothesis));
  return agreements;
}

Agreement median_of(const std::vector<Agreement>& agreements) {
  if (agreements.empty()) return {};
  const auto median = [&](double Agreement::*member) {
    std::vector<double> values;
    for (const Agreement& agreement : agreements) values.push_back(agreement.*member);
    return quantile(std::move(values), 0.5);
  };
  return {median(&Agreement::median_m),      median(&Agreement::relative),
          median(&Agreement::systematic),    median(&Agreement::tilt_rad),
          median(&Agreement::overlap_ratio), median(&Agreement::contradicted_ratio)};
}

std::vector<ReadingHypothesis> reading_hypotheses(double units_per_m) {
  constexpr double kSame_ratio = 0.02;
  std::vector<double> factors{0.001, 0.01, 0.1, 0.2, 0.5, 2, 5, 10, 100, 1000};
  for (const double usual : {1000.0, 5000.0}) {
    const double factor = units_per_m / usual;
    const auto is_same = [&](double other) { return std::abs(factor / other - 1) < kSame_ratio; };
    if (!is_same(1) && std::ranges::none_of(factors, is_same)) factors.push_back(factor);
  }
  std::vector<ReadingHypothesis> all{{}, {.poses_ignored = true}, {.real_part_first = true}};
  for (const bool inverted : {false, true})
    for (const bool flipped : {false, true}) {
      if (inverted || flipped) all.push_back({.poses_inverted = inverted, .fy_flipped = flipped});
      if (inverted && flipped) continue;
      for (const double factor : factors)
        all.push_back({.poses_inverted = inverted, .fy_flipped = flipped, .depth_factor = factor});
    }
  std::ranges::stable_sort(all.begin() + 2, all.end(), {}, &ReadingHypothesis::changes);
  return all;
}

}  // namespace hm
