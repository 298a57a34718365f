#include "hm/slam/laser/search/correlative_map.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hm/core/check.hpp"

namespace hm {
namespace {

constexpr double kMaxExtent_m = 500;
constexpr double kKernelSigmas = 3;

std::vector<Vec2> usable_points(std::span<const Vec2> points_m) {
  std::vector<Vec2> usable;
  for (const Vec2& point : points_m)
    if (point.allFinite() && (usable.empty() || (point - usable.front()).norm() < kMaxExtent_m))
      usable.push_back(point);
  return usable;
}

}  // namespace

CorrelativeMap::CorrelativeMap(std::span<const Vec2> points_m, const CorrelativeMapParams& params,
                               std::optional<ObservedArea> seen)
    : resolution_m_(params.resolution_m), seen_(std::move(seen)) {
  HM_CHECK(params.resolution_m > 0 && params.sigma_m > 0 && params.half_width_m >= 0 && params.levels >= 1 &&
               params.levels < 16,
           "resolution {} m, sigma {} m, {} levels", params.resolution_m, params.sigma_m, params.levels);
  levels_.emplace_back();
  const std::vector<Vec2> usable = usable_points(points_m);
  if (!usable.empty()) splat(usable, params.sigma_m, params.half_width_m);
  for (int level = 1; level < params.levels; ++level)
    levels_.push_back(coarser(levels_.back(), 1 << (level - 1)));
  if (seen_) find_seen_blocks();
}

void CorrelativeMap::find_seen_blocks() {
  seen_width_ = levels_.front().width / kSeenBlock;
  seen_height_ = levels_.front().height / kSeenBlock;
  const double block_m = kSeenBlock * resolution_m_;
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    // A square may begin in any cell of its block.
    const unsigned reach = kSeenBlock - 1 + (1U << level);
    const double side_m = block_m * ((reach + kSeenBlock - 1) / kSeenBlock);
    std::vector<std::uint8_t>& all_seen = levels_[level].all_seen;
    all_seen.reserve(static_cast<std::size_t>(seen_width_) * seen_height_);
    for (unsigned y = 0; y < seen_height_; ++y)
      for (unsigned x = 0; x < seen_width_; ++x) {
        const Vec2 low_m = origin_m_ + block_m * Vec2(x, y);
        all_seen.push_back(seen_->contains(low_m, low_m + Vec2(side_m, side_m)));
      }
  }
}

void CorrelativeMap::splat(std::span<const Vec2> points_m, double sigma_m, double half_width_m) {
  const int radius = static_cast<int>(std::ceil((kKernelSigmas * sigma_m + half_width_m) / resolution_m_));
  Vec2 low = points_m.front(), high = low;
  for (const Vec2& point : points_m) low = low.cwiseMin(point), high = high.cwiseMax(point);
  origin_m_ = ((low / resolution_m_).array().floor() - radius).matrix() * resolution_m_;
  Level& base = levels_.front();
  const Eigen::Vector2i size = cell_of(high) + Eigen::Vector2i::Constant(radius + 1);
  base.width = static_cast<unsigned>(size.x());
  base.height = static_cast<unsigned>(size.y());
  base.values.assign(static_cast<std::size_t>(base.width) * base.height, 0);
  // The likelihood is a product of one factor along x and one along y.
  const auto factors = [&](double point, double origin, int first, int last) {
    std::vector<double> values;
    for (int i = first; i <= last; ++i) {
      const double distance_m =
          std::max(0.0, std::abs(origin + resolution_m_ * (i + 0.5) - point) - half_width_m);
      values.push_back(std::exp(-0.5 * distance_m * distance_m / (sigma_m * sigma_m)));
    }
    return values;
  };
  for (const Vec2& point : points_m) {
    const Eigen::Vector2i cell = cell_of(point);
    const Eigen::Vector2i first = (cell.array() - radius).max(0),
                          last = (cell.array() + radius).min(size.array() - 1);
    const std::vector<double> along_x = factors(point.x(), origin_m_.x(), first.x(), last.x());
    const std::vector<double> along_y = factors(point.y(), origin_m_.y(), first.y(), last.y());
    for (int y = first.y(); y <= last.y(); ++y) {
      std::uint8_t* row =
          &base.values[static_cast<std::size_t>(y) * base.width + static_cast<std::size_t>(first.x())];
      const double factor = 255 * along_y[static_cast<std::size_t>(y - first.y())];
      for (std::size_t x = 0; x < along_x.size(); ++x)
        row[x] = std::max(row[x], static_cast<std::uint8_t>(factor * along_x[x] + 0.5));
    }
  }
}

/// The maximum over two squares of the finer level in each direction, first along rows, then along columns.
CorrelativeMap::Level CorrelativeMap::coarser(const Level& fine, int step) {
  Level coarse;
  coarse.margin = fine.margin + step;
  if (fine.values.empty()) return coarse;
  const auto shift = static_cast<unsigned>(step);
  coarse.width = fine.width + shift;
  coarse.height = fine.height + shift;
  std::vector<std::uint8_t> rows(static_cast<std::size_t>(coarse.width) * fine.height, 0);
  for (std::size_t y = 0; y < fine.height; ++y) {
    const std::uint8_t* from = &fine.values[y * fine.width];
    std::uint8_t* to = &rows[y * coarse.width];
    std::copy(from, from + fine.width, to + shift);
    for (std::size_t x = 0; x < fine.width; ++x) to[x] = std::max(to[x], from[x]);
  }
  coarse.values.assign(static_cast<std::size_t>(coarse.width) * coarse.height, 0);
  std::copy(rows.begin(), rows.end(),
            coarse.values.begin() + static_cast<std::ptrdiff_t>(shift * coarse.width));
  for (std::size_t i = 0; i < rows.size(); ++i) coarse.values[i] = std::max(coarse.values[i], rows[i]);
  return coarse;
}

double CorrelativeMap::score(std::span<const Vec2> points_m, const SE2& T_map_points) const {
  if (points_m.empty()) return 0;
  double sum = 0;
  for (const Vec2& point : points_m) {
    const Vec2 at = (T_map_points * point - origin_m_) / resolution_m_ - Vec2(0.5, 0.5);
    if (!(at.cwiseAbs().maxCoeff() < 1e6)) continue;
    const Vec2 low = at.array().floor();
    const Vec2 part = at - low;
    const int x = static_cast<int>(low.x()), y = static_cast<int>(low.y());
    sum += (1 - part.y()) * ((1 - part.x()) * value(x, y) + part.x() * value(x + 1, y)) +
           part.y() * ((1 - part.x()) * value(x, y + 1) + part.x() * value(x + 1, y + 1));
  }
  return sum / (255.0 * static_cast<double>(points_m.size()));
}

std::size_t CorrelativeMap::bytes() const {
  std::size_t sum = 0;
  for (const Level& level : levels_) sum += level.values.size() + level.all_seen.size();
  return sum;
}

}  // namespace hm
