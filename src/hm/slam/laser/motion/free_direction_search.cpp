#include "hm/slam/laser/motion/free_direction_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace hm {
namespace {

constexpr CorrelativeMapParams kWallRaster{0.05, 0.04, 1, 0.02};
/// Points of neighbouring beams are of one wall up to this distance: in the scan, and in keyframes.
constexpr double kScanSpacing_m = 0.25, kKeyframeSpacing_m = 0.5;
constexpr std::size_t kMinWallPoints = 40;
/// At most so many points are scored, evenly taken: a finer laser shows the same walls.
constexpr std::size_t kMostPoints = 360;
constexpr int kSteps = 55;
constexpr double kStep_m = 0.01;
static_assert(kSteps * kStep_m > FreeDirectionSearch::kReach_m - 1e-9 &&
              kSteps * kStep_m < FreeDirectionSearch::kReach_m + 1e-9);
/// Weight of a point that fits, in log likelihood: less than its noise alone says, as neighbours fail
/// together.
constexpr double kPointWeight = 2;
/// Scores that differ less than this are equal: between bare walls the nearest place scores best, by so much.
constexpr double kEqualScores = 0.002;
/// Probability, relative to that of no deviation, of any other: a velocity may be wrong altogether.
constexpr double kAnyDeviation = 0.001;
/// A shift is known no better than this.
constexpr double kLeastSigma_m = 0.03;

/// Calls `take` with both ends of each piece of wall between two neighbouring beams.
template <class Take>
void for_each_wall(const PlanarScan& scan, double max_spacing_m, Take&& take) {
  for (std::size_t i = 1; i < scan.size(); ++i)
    if ((scan.points_m[i] - scan.points_m[i - 1]).squaredNorm() < max_spacing_m * max_spacing_m)
      take(scan.points_m[i - 1], scan.points_m[i]);
}

std::vector<Vec2> points_on_walls(const PlanarScan& scan) {
  std::vector<Vec2> points_m;
  for_each_wall(scan, kScanSpacing_m, [&](const Vec2&, const Vec2& to) { points_m.push_back(to); });
  if (const std::size_t all = points_m.size(); all > kMostPoints) {
    for (std::size_t i = 0; i < kMostPoints; ++i) points_m[i] = points_m[i * all / kMostPoints];
    points_m.resize(kMostPoints);
  }
  return points_m;
}

/// Of a weighted distribution.
struct Moments {
  double sum = 0, first = 0, second = 0;
  void add(double value, double weight) {
    sum += weight, first += weight * value, second += weight * value * value;
  }
  [[nodiscard]] double mean() const { return first / sum; }
  [[nodiscard]] double variance() const { return second / sum - mean() * mean(); }
};

}  // namespace

void FreeDirectionSearch::clear() {
  keyframes_.clear();
  raster_.reset();
}

void FreeDirectionSearch::add(const PlanarScan& scan, const SE2& T_odom_base) {
  if (!keyframes_.is_due(T_odom_base)) return;
  std::vector<Vec2> walls_m;
  for_each_wall(scan, kKeyframeSpacing_m, [&](const Vec2& from, const Vec2& to) {
    const int pieces = 1 + static_cast<int>((to - from).norm() / kWallRaster.resolution_m);
    for (int k = 0; k < pieces; ++k) walls_m.push_back(T_odom_base * Vec2(from + (to - from) * k / pieces));
  });
  keyframes_.add(T_odom_base, std::move(walls_m));
  raster_.reset();
}

const CorrelativeMap& FreeDirectionSearch::raster() {
  if (raster_) return *raster_;
  std::vector<Vec2> walls_m;
  for (const auto& keyframe : keyframes_.all())
    walls_m.insert(walls_m.end(), keyframe.content.begin(), keyframe.content.end());
  return raster_.emplace(walls_m, kWallRaster);
}

std::optional<FoundShift> FreeDirectionSearch::find(const PlanarScan& scan, const SE2& T_odom_base,
                                                    const Vec2& direction_odom, double predicted_sigma_m) {
  const std::vector<Vec2> points_m = points_on_walls(scan);
  if (keyframes_.all().empty() || points_m.size() < kMinWallPoints) return std::nullopt;
  std::array<double, 2 * kSteps + 1> scores;
  for (int k = -kSteps; k <= kSteps; ++k) {
    const Vec2 at_m = T_odom_base.translation() + k * kStep_m * direction_odom;
    scores[static_cast<std::size_t>(k + kSteps)] = raster().score(points_m, SE2(at_m, T_odom_base.angle()));
  }
  const double predicted = scores[kSteps];
  for (double& score : scores) {
    const double better = score - predicted;
    score = std::copysign(std::max(std::abs(better) - kEqualScores, 0.0), better);
  }
  const double highest = *std::ranges::max_element(scores);
  Moments by_walls, with_prediction;
  for (int k = -kSteps; k <= kSteps; ++k) {
    const double shift_m = k * kStep_m, deviations = shift_m / predicted_sigma_m;
    const double below = highest - scores[static_cast<std::size_t>(k + kSteps)];
    const double likelihood = std::exp(-kPointWeight * static_cast<double>(points_m.size()) * below);
    by_walls.add(shift_m, likelihood);
    with_prediction.add(shift_m, likelihood * (std::exp(-0.5 * deviations * deviations) + kAnyDeviation));
  }
  return FoundShift{with_prediction.mean(),
                    std::sqrt(std::max(by_walls.variance(), kLeastSigma_m * kLeastSigma_m))};
}

}  // namespace hm
