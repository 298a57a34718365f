#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "hm/core/param_doc.hpp"

namespace hm {

/// Where the four rotors stand. kPlus: front, left, back, right. kCross: the same turned by 45 degrees, thus
/// front left, back left, back right, front right. The first and third turn clockwise seen from above, so
/// that their drag turns the vehicle counter-clockwise.
enum class RotorLayout : std::uint8_t { kPlus, kCross };
inline constexpr std::array<std::string_view, 2> kRotorLayoutNames{"plus", "cross"};

/// Model of the vehicle that the controllers use. Defaults: the Pelican of RotorS (Furrer et al. 2016,
/// rotors_description) with the mass that hovers at the 48.5 % thrust of the author's controller.
struct QuadrotorModel {
  float mass_kg = 1.387F;
  float inertia_xy_kg_m2 = 0.01F, inertia_z_kg_m2 = 0.02F;
  float arm_m = 0.21F;
  float thrust_constant_n_s2 = 9.9865e-6F;
  float torque_ratio_m = 0.016F;
  float max_speed_rad_s = 838;
  /// Least rotor speed in flight.
  float idle_speed_rad_s = 120;
  float motor_s = 0.0188F;
  float drag_per_s = 0.136F;
  RotorLayout layout = RotorLayout::kPlus;

  /// Thrust of one rotor at a speed, and the reverse.
  [[nodiscard]] float rotor_thrust_n(float speed_rad_s) const {
    return thrust_constant_n_s2 * speed_rad_s * speed_rad_s;
  }
  /// Thrust of all rotors at full speed.
  [[nodiscard]] float full_thrust_n() const { return 4 * rotor_thrust_n(max_speed_rad_s); }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"mass_kg", {0.05, 50}, "mass of the vehicle as the controllers assume it"}, self.mass_kg);
    v(ParamDoc{"inertia_xy_kg_m2", {1e-5, 10}, "moments of inertia about the x and y axes"},
      self.inertia_xy_kg_m2);
    v(ParamDoc{"inertia_z_kg_m2", {1e-5, 10}, "moment of inertia about the z axis"}, self.inertia_z_kg_m2);
    v(ParamDoc{"arm_m", {0.02, 2}, "distance from the middle to the axis of a rotor"}, self.arm_m);
    v(ParamDoc{"thrust_constant_n_s2", {1e-9, 1}, "thrust of a rotor per squared speed"},
      self.thrust_constant_n_s2);
    v(ParamDoc{"torque_ratio_m", {1e-4, 1}, "torque of a rotor about its axis per thrust"},
      self.torque_ratio_m);
    v(ParamDoc{"max_speed_rad_s", {1, 1e4}, "maximum rotor speed"}, self.max_speed_rad_s);
    v(ParamDoc{"motor_s", {0, 1}, "time constant of the rotors, mean of speeding up and slowing down"},
      self.motor_s);
    v(ParamDoc{"drag_per_s", {0, 5}, "deceleration by rotor drag per horizontal speed"}, self.drag_per_s);
    v(ParamDoc{"layout", {}, "where the rotors stand"}, self.layout, kRotorLayoutNames);
  }
};

}  // namespace hm
