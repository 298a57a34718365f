#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "hm/sensors/laser_rig.hpp"
#include "hm/sensors/laser_scan.hpp"

namespace hm {

/// How far a vehicle can fly in each horizontal direction before its hull touches something, as a laser sees
/// it.
struct FreeDistances {
  static constexpr std::size_t kDirections = 72;
  /// Unit of a distance; distances are rounded down.
  static constexpr double kUnit_m = 0.02;
  /// Nothing seen that way, or further than 5.08 m.
  static constexpr std::uint8_t kNothing = 255;

  /// From the base's origin to the first obstacle, by direction, 5 degrees each, counter-clockwise from
  /// straight ahead.
  std::array<std::uint8_t, kDirections> units = filled();

  /// The distance (m) in the direction nearest to an angle from straight ahead, counter-clockwise.
  [[nodiscard]] std::optional<double> towards(double angle_rad) const;

 private:
  static constexpr std::array<std::uint8_t, kDirections> filled() {
    std::array<std::uint8_t, kDirections> all{};
    all.fill(kNothing);
    return all;
  }
};

/// Where the vehicle was at a scan, and how wide it is.
struct HullPose {
  double roll_rad = 0, pitch_rad = 0;
  double height_m = 0;  ///< of the base above the floor: end points on the floor are no obstacles
  double radius_m = 0;  ///< of the hull about the base
};

/// Free distances in the frame of the vehicle turned level, from the beams in the scan plane: in each
/// direction the nearest end point that is not further than the hull's radius from the line of flight.
[[nodiscard]] FreeDistances free_distances(const LaserScan& scan, const LaserRig& rig, const HullPose& hull);

}  // namespace hm
