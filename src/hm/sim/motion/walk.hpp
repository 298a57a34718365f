#pragma once
#include <vector>

#include "hm/geometry/se3.hpp"

namespace hm {

/// Pose of a camera held by a walking person: position, heading (yaw about z, 0 along x) and pitch (up is
/// positive).
struct WalkPoint {
  Vec3 position = Vec3::Zero();
  double yaw_rad = 0;
  double pitch_rad = 0;
};

/// Smooth (C1) walk along way points at limited speed and angular rates.
class Walk {
 public:
  struct Limits {
    double speed_m_s = 0.8;
    double yaw_rate_rad_s = 1.0;
    double pitch_rate_rad_s = 0.9;
    double smoothing_s = 0.8;  ///< half width of the window that rounds corners
  };
  /// `way_points`: at least two. Yaw is not wrapped.
  Walk(const std::vector<WalkPoint>& way_points, const Limits& limits);

  [[nodiscard]] double duration_s() const;
  [[nodiscard]] double length_m() const;
  [[nodiscard]] WalkPoint point_at(double time_s) const;
  /// Camera pose (x right, y down, z forward) without roll. Times outside the walk are clamped.
  [[nodiscard]] SE3 T_world_camera(double time_s) const;

 private:
  std::vector<WalkPoint> samples_;
};

/// Walk along the hallway and through every room, on paths (house_tours.hpp) that observe nearly everything
/// visible from within 4 m, and back to the start.
Walk house_walk();
/// Walk around the room, looking at all walls, floor, ceiling and solids.
Walk room_walk();
/// Walk to the end of the corridor and back.
Walk corridor_walk();

}  // namespace hm
