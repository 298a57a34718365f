#pragma once
#include <vector>

#include "hm/geometry/se3.hpp"

namespace hm {

/// Where a person holds the camera while walking: position, heading (yaw about z, 0 along x) and pitch
/// (up is positive).
struct WalkPoint {
  Vec3 position = Vec3::Zero();
  double yaw_rad = 0;
  double pitch_rad = 0;
};

/// A smooth (C1) walk along way points at limited speed and turning rates.
class Walk {
 public:
  struct Limits {
    double speed_m_s = 0.8;
    double yaw_rate_rad_s = 1.0;
    double pitch_rate_rad_s = 0.9;
    double smoothing_s = 0.8;  ///< half width of the window that rounds corners
  };
  /// Way points in order (at least two). Yaw is taken as given, without wrapping.
  Walk(const std::vector<WalkPoint>& way_points, const Limits& limits);

  [[nodiscard]] double duration_s() const;
  [[nodiscard]] double length_m() const;
  [[nodiscard]] WalkPoint point_at(double time_s) const;
  /// The camera pose (x right, y down, z forward), level: no roll. Times outside are clamped.
  [[nodiscard]] SE3 T_world_camera(double time_s) const;

 private:
  std::vector<WalkPoint> samples_;
};

/// Along the hallway and through every room, by ways (house_tours.hpp) that see nearly all that a person in
/// the rooms could see within 4 m, and back to the start.
Walk house_walk();
/// Around the room, looking at all of its walls, floor, ceiling and solids.
Walk room_walk();
/// To the end of the corridor and back.
Walk corridor_walk();

}  // namespace hm
