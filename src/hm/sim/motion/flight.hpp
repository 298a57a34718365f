#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// The base of a quadrotor that stands on the ground is this high above it (dissertation 2.2: the City
/// Flyer's base_link over its footprint).
inline constexpr double kBaseOverGround_m = 0.195;

/// Where a flight goes: a place of the base, and how long the vehicle hovers (or stands) there.
struct FlightPoint {
  Vec3 position = Vec3::Zero();
  double hover_s = 0;
};

/// How a quadrotor is flown.
struct FlightParams {
  double speed_m_s = 1.0;
  /// Limit of the vertical speed.
  double climb_m_s = 0.5;
  /// Yaw rate of a turn by 180 degrees.
  double yaw_rate_rad_s = 0.9;
  double sway_m = 0.02;  ///< standard deviation of the wandering around the way

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"speed_m_s",
               {0.1, 2},
               "speed of the flight; corners keep their radius above 1 m/s",
               ParamLevel::kBasic},
      self.speed_m_s);
    v(ParamDoc{"sway_m", {0, 0.1}, "the vehicle wanders around its way by this standard deviation"},
      self.sway_m);
  }
};

/// The motion of a vehicle at a moment. Velocities and accelerations of the base's origin in the world frame,
/// angular ones in the base frame.
struct FlightState {
  SE3 T_world_base;
  Vec3 velocity_world_m_s = Vec3::Zero();
  Vec3 acceleration_world_m_s2 = Vec3::Zero();
  Vec3 angular_velocity_base_rad_s = Vec3::Zero();
  Vec3 angular_acceleration_base_rad_s2 = Vec3::Zero();
};

/// A quadrotor's flight along way points: four times continuously differentiable, from rest to rest, heading
/// where it goes. Position and yaw are uniform quintic B-splines over time; the vehicle tilts so that its
/// thrust gives the acceleration (Mellinger and Kumar 2011, eqs 6-8), which makes it level at rest. All
/// derivatives are analytic. Immutable: may be used from several threads.
class Flight {
 public:
  /// Way points in order (at least two). The seed decides the sway; the vehicle does not sway while it waits
  /// at the first and the last point, where it stands.
  Flight(const std::vector<FlightPoint>& way_points, const FlightParams& params, std::uint64_t seed);

  [[nodiscard]] double duration_s() const;
  [[nodiscard]] double length_m() const;
  /// Times outside are clamped.
  [[nodiscard]] SE3 T_world_base(double time_s) const;
  [[nodiscard]] FlightState state(double time_s) const;

 private:
  using Control = Eigen::Vector4d;  ///< x, y, z, yaw
  /// The spline and its first four derivatives.
  [[nodiscard]] std::array<Control, 5> derivatives(double time_s) const;

  double knot_s_ = 0;
  std::vector<Control> controls_;
};

/// From the hallway through all rooms but the study's far end, over tables, beds, a platform and a railing,
/// and back.
Flight house_flight(const FlightParams& params, std::uint64_t seed);
/// Twice around the room, over its chest, ramp and ball.
Flight room_flight(const FlightParams& params, std::uint64_t seed);
/// To the end of the corridor and back, with changes of height.
Flight corridor_flight(const FlightParams& params, std::uint64_t seed);

}  // namespace hm
