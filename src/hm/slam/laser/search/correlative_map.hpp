#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hm/geometry/se2.hpp"

namespace hm {

struct CorrelativeMapParams {
  double resolution_m = 0.05;
  double sigma_m = 0.06;  ///< standard deviation of a point's distance from its surface
  int levels = 7;         ///< of the pyramid; a cell of level h covers 2^h x 2^h cells
  /// Up to this distance along each axis a point is as likely as on the surface: where many scans show a
  /// surface, some point of it is nearer by chance, which must not count.
  double half_width_m = 0;
};

/// Likelihood raster for correlative scan matching: exp(-d^2 / 2 sigma^2), scaled to 0 to 255, of the
/// distance d (less `half_width_m` along each axis) from each cell to the nearest map point, and a pyramid of
/// its maxima as upper bounds (Olson, ICRA 2009, section III; Hess et al., ICRA 2016, section V-B). 0 outside
/// the raster. Immutable.
class CorrelativeMap {
 public:
  /// Builds the map from points (m), ignoring non-finite ones and those more than 500 m from the first.
  CorrelativeMap(std::span<const Vec2> points_m, const CorrelativeMapParams& params);

  /// Maximum over the cells [x, x + 2^level) x [y, y + 2^level), for any x and y.
  [[nodiscard]] std::uint8_t bound(int level, int x, int y) const {
    const Level& l = levels_[static_cast<std::size_t>(level)];
    const unsigned column = static_cast<unsigned>(x + l.margin), row = static_cast<unsigned>(y + l.margin);
    if (column >= l.width || row >= l.height) return 0;
    return l.values[static_cast<std::size_t>(row) * l.width + column];
  }
  [[nodiscard]] std::uint8_t value(int x, int y) const { return bound(0, x, y); }
  /// Cell that contains a point.
  [[nodiscard]] Eigen::Vector2i cell_of(const Vec2& point_m) const {
    return ((point_m - origin_m_) / resolution_m_).array().floor().cast<int>();
  }
  /// Mean likelihood (0 to 1) of points moved by T_map_points, interpolated between cell centres.
  [[nodiscard]] double score(std::span<const Vec2> points_m, const SE2& T_map_points) const;

  [[nodiscard]] double resolution_m() const { return resolution_m_; }
  [[nodiscard]] int levels() const { return static_cast<int>(levels_.size()); }
  [[nodiscard]] bool empty() const { return levels_.front().values.empty(); }
  [[nodiscard]] Vec2 low_m() const { return origin_m_; }
  [[nodiscard]] Vec2 high_m() const {
    return origin_m_ + resolution_m_ * Vec2(levels_.front().width, levels_.front().height);
  }
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Level {
    unsigned width = 0, height = 0;
    int margin = 0;  // cells beyond the lower left corner of the raster
    std::vector<std::uint8_t> values;
  };
  void splat(std::span<const Vec2> points_m, double sigma_m, double half_width_m);
  static Level coarser(const Level& fine, int step);

  double resolution_m_;
  Vec2 origin_m_ = Vec2::Zero();
  std::vector<Level> levels_;
};

}  // namespace hm
