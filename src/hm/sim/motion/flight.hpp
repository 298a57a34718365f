#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Height of a landed quadrotor's base above the ground (dissertation 2.2: the City Flyer's base_link over
/// its footprint).
inline constexpr double kBaseOverGround_m = 0.195;

/// Way point of a flight: position of the base (world), and time of hovering (or standing) there.
struct FlightPoint {
  Vec3 position = Vec3::Zero();
  double hover_s = 0;
};

/// Parameters of a quadrotor's flight.
struct FlightParams {
  double speed_m_s = 1.0;
  /// Maximum vertical speed.
  double climb_m_s = 0.5;
  /// Mean yaw rate of a rotation by 180 degrees.
  double yaw_rate_rad_s = 0.9;
  double sway_m = 0.02;  ///< standard deviation of the deviation from the path

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"speed_m_s",
               {0.1, 2},
               "speed of the flight; above 1 m/s the radius of corners is constant",
               ParamLevel::kBasic},
      self.speed_m_s);
  }
};

/// Motion of a vehicle at one time. Velocities and accelerations of the base's origin in the world frame,
/// angular ones in the base frame.
struct FlightState {
  SE3 T_world_base;
  Vec3 velocity_world_m_s = Vec3::Zero();
  Vec3 acceleration_world_m_s2 = Vec3::Zero();
  Vec3 angular_velocity_base_rad_s = Vec3::Zero();
  Vec3 angular_acceleration_base_rad_s2 = Vec3::Zero();
};

/// Flight of a quadrotor along way points: four times continuously differentiable, from rest to rest, heading
/// along the path. Position and yaw are uniform quintic B-splines over time; the attitude follows from the
/// thrust direction (Mellinger and Kumar 2011, eqs 6-8), level at rest. All derivatives are analytic.
/// Immutable, hence thread safe.
class Flight {
 public:
  /// `way_points`: at least two. The seed determines the sway; there is none while the vehicle stands at the
  /// first and the last point.
  Flight(const std::vector<FlightPoint>& way_points, const FlightParams& params, std::uint64_t seed);

  [[nodiscard]] double duration_s() const;
  [[nodiscard]] double length_m() const;
  /// Pose at a time; times outside the flight are clamped.
  [[nodiscard]] SE3 T_world_base(double time_s) const;
  [[nodiscard]] FlightState state(double time_s) const;

 private:
  using Control = Eigen::Vector4d;  ///< x, y, z, yaw
  /// Spline and its first four derivatives.
  [[nodiscard]] std::array<Control, 5> derivatives(double time_s) const;

  double knot_s_ = 0;
  std::vector<Control> controls_;
};

/// Flight from the hallway through all rooms except the study's far end, over tables, beds, a platform and a
/// railing, and back.
Flight house_flight(const FlightParams& params, std::uint64_t seed);
/// Flight twice around the room, over its chest, ramp and ball.
Flight room_flight(const FlightParams& params, std::uint64_t seed);
/// Flight to the end of the corridor and back, with changes of height.
Flight corridor_flight(const FlightParams& params, std::uint64_t seed);

}  // namespace hm
