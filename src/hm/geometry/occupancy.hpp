#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string_view>
#include <vector>

namespace hm {

/// State of a point or cell of a map.
enum class Occupancy : std::uint8_t { kUnknown, kFree, kOccupied };
constexpr std::string_view to_string(Occupancy occupancy) {
  return occupancy == Occupancy::kFree ? "free" : occupancy == Occupancy::kOccupied ? "occupied" : "unknown";
}

/// Known cubic cell, as exported by maps to viewers and file writers.
struct OccupancyVoxel {
  Eigen::Vector3f p_world_centre = Eigen::Vector3f::Zero();  ///< metres
  float size_m = 0;                                          ///< edge
  float probability = 0;                                     ///< of being occupied, 0 to 1
  Occupancy state = Occupancy::kUnknown;
};

/// Vertical interval of one map column with a single state.
struct VerticalVolume {
  double bottom_m = 0, top_m = 0;  ///< world heights
  double probability = 0;          ///< of being occupied, 0 to 1
  Occupancy state = Occupancy::kUnknown;
  [[nodiscard]] double height_m() const { return top_m - bottom_m; }
};

}  // namespace hm
