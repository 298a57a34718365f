#pragma once
#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "hm/geometry/image.hpp"
#include "hm/geometry/occupancy.hpp"

namespace hm {

/// Horizontal 2D occupancy grid. Cell (x, y) covers origin + [x, x + 1) * resolution in x and likewise in y:
/// row 0 of the image has the lowest y. A cell holds the probability of being occupied in percent, 0 to 100,
/// or kUnknown.
struct OccupancyGrid2D {
  static constexpr std::uint8_t kUnknown = 255;

  double resolution_m = 0.1;
  Eigen::Vector2d origin_m = Eigen::Vector2d::Zero();  ///< world, lower left corner of cell (0, 0)
  Image<std::uint8_t> cells;

  /// Column index of the cell containing an x coordinate; may lie outside the image. Likewise for rows.
  [[nodiscard]] int column_of(double x_m) const {
    return static_cast<int>(std::floor((x_m - origin_m.x()) / resolution_m));
  }
  [[nodiscard]] int row_of(double y_m) const {
    return static_cast<int>(std::floor((y_m - origin_m.y()) / resolution_m));
  }
  [[nodiscard]] Eigen::Vector2d center_of(int x, int y) const {
    return origin_m + resolution_m * Eigen::Vector2d(x + 0.5, y + 0.5);
  }
  /// State of a cell: occupied from `occupied_percent` up, free below; cells outside the image are unknown.
  [[nodiscard]] Occupancy state(int x, int y, int occupied_percent = 50) const {
    if (!cells.contains(x, y) || cells(x, y) == kUnknown) return Occupancy::kUnknown;
    return cells(x, y) >= occupied_percent ? Occupancy::kOccupied : Occupancy::kFree;
  }
};

}  // namespace hm
