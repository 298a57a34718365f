#include "hm/slam/laser/free_direction_search.hpp"

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
constexpr int kSteps = 11;
constexpr double kStep_m = 0.05;
static_assert(kSteps * kStep_m > FreeDirectionSearch::kReach_m - 1e-9 &&
              kSteps * kStep_m < FreeDirectionSearch::kReach_m + 1e-9);
/// Weight of a point that fits, in log likelihood: less than its noise alone says, as neighbours fail
/// together.
constexpr double kPointWeight = 2;
/// Deviation of the motion from the last velocity: half of an acceleration, times the time squared, within
/// these. Stamps may say more time than it was: those of scans that waited in a queue.
constexpr double kHalfAcceleration_m_s2 = 1.5, kLeastDeviation_m = 0.02, kMostDeviation_m = 0.1;
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
                                                    const Vec2& direction_odom, double elapsed_s) {
  std::vector<Vec2> points_m;
  for_each_wall(scan, kScanSpacing_m, [&](const Vec2&, const Vec2& to) { points_m.push_back(to); });
  if (keyframes_.all().empty() || points_m.size() < kMinWallPoints) return std::nullopt;
  std::array<double, 2 * kSteps + 1> scores;
  for (int k = -kSteps; k <= kSteps; ++k) {
    const Vec2 at_m = T_odom_base.translation() + k * kStep_m * direction_odom;
    scores[static_cast<std::size_t>(k + kSteps)] = raster().score(points_m, SE2(at_m, T_odom_base.angle()));
  }
  const double highest = *std::ranges::max_element(scores);
  const double deviation_m =
      std::clamp(kHalfAcceleration_m_s2 * elapsed_s * elapsed_s, kLeastDeviation_m, kMostDeviation_m);
  double sum = 0, first_m = 0, second_m2 = 0;
  for (int k = -kSteps; k <= kSteps; ++k) {
    const double shift_m = k * kStep_m, deviations = shift_m / deviation_m;
    const double below = highest - scores[static_cast<std::size_t>(k + kSteps)];
    const double weight = (std::exp(-0.5 * deviations * deviations) + kAnyDeviation) *
                          std::exp(-kPointWeight * static_cast<double>(points_m.size()) * below);
    sum += weight, first_m += weight * shift_m, second_m2 += weight * shift_m * shift_m;
  }
  const double mean_m = first_m / sum, variance_m2 = second_m2 / sum - mean_m * mean_m;
  return FoundShift{mean_m, std::sqrt(std::max(variance_m2, kLeastSigma_m * kLeastSigma_m))};
}

}  // namespace hm
