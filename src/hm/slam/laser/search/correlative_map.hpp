#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "hm/geometry/se2.hpp"
#include "hm/slam/laser/search/observed_area.hpp"

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
/// the raster. With the area that was observed also a pyramid of what is certainly inside it. Immutable.
class CorrelativeMap {
 public:
  /// Builds the map from points (m), ignoring non-finite ones and those more than 500 m from the first.
  CorrelativeMap(std::span<const Vec2> points_m, const CorrelativeMapParams& params,
                 std::optional<ObservedArea> seen = {});

  /// Maximum over the cells [x, x + 2^level) x [y, y + 2^level), for any x and y.
  [[nodiscard]] std::uint8_t bound(int level, int x, int y) const {
    const Level& l = levels_[static_cast<std::size_t>(level)];
    const unsigned column = static_cast<unsigned>(x + l.margin), row = static_cast<unsigned>(y + l.margin);
    if (column >= l.width || row >= l.height) return 0;
    return l.values[static_cast<std::size_t>(row) * l.width + column];
  }
  /// Adds bound(level, ., .) of the square at (x, y) and of its neighbours to the right, above, and both.
  void add_bounds(int level, int x, int y, std::array<std::uint32_t, 4>& sums) const {
    const Level& l = levels_[static_cast<std::size_t>(level)];
    const unsigned column = static_cast<unsigned>(x + l.margin), row = static_cast<unsigned>(y + l.margin);
    const int side = 1 << level;
    const auto apart = static_cast<unsigned>(side);
    if (column < l.width && row < l.height && column + apart < l.width && row + apart < l.height) {
      const std::uint8_t* value = &l.values[static_cast<std::size_t>(row) * l.width + column];
      const std::uint8_t* above = value + static_cast<std::size_t>(apart) * l.width;
      sums[0] += value[0];
      sums[1] += value[apart];
      sums[2] += above[0];
      sums[3] += above[apart];
      return;
    }
    sums[0] += bound(level, x, y);
    sums[1] += bound(level, x + side, y);
    sums[2] += bound(level, x, y + side);
    sums[3] += bound(level, x + side, y + side);
  }
  [[nodiscard]] std::uint8_t value(int x, int y) const { return bound(0, x, y); }
  /// Area that was observed; null: not known.
  [[nodiscard]] const ObservedArea* seen() const { return seen_ ? &*seen_ : nullptr; }
  /// True only if all of the cells [x, x + 2^level) x [y, y + 2^level) were observed. It is looked up by
  /// blocks of kSeenBlock x kSeenBlock cells of the raster: false for some squares at the border of the area,
  /// and for all that begin outside the raster.
  [[nodiscard]] bool all_seen(int level, int x, int y) const {
    const Level& l = levels_[static_cast<std::size_t>(level)];
    const unsigned column = static_cast<unsigned>(x) / kSeenBlock,
                   row = static_cast<unsigned>(y) / kSeenBlock;
    if (column >= seen_width_ || row >= seen_height_) return false;
    return l.all_seen[static_cast<std::size_t>(row) * seen_width_ + column] != 0;
  }
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
    std::vector<std::uint8_t> all_seen;  // by blocks: whether all that a square beginning in it can reach is
  };
  static constexpr unsigned kSeenBlock = 4;
  void splat(std::span<const Vec2> points_m, double sigma_m, double half_width_m);
  static Level coarser(const Level& fine, int step);
  void find_seen_blocks();

  double resolution_m_;
  Vec2 origin_m_ = Vec2::Zero();
  std::vector<Level> levels_;
  std::optional<ObservedArea> seen_;
  unsigned seen_width_ = 0, seen_height_ = 0;  // blocks
};

}  // namespace hm
