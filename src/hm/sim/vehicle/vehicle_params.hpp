#pragma once
#include <string_view>

#include "hm/core/params.hpp"

namespace hm {

/// Rotors of a quadrotor. Defaults: the Pelican of RotorS (Furrer et al. 2016, rotors_description), with
/// whose 838 rad/s four rotors lift 1.387 kg at 48.5 % of their thrust, as the dissertation's vehicle did.
struct RotorParams {
  double thrust_constant_n_s2 = 9.9865e-6;  ///< kT in T = kT W^2
  double torque_ratio_m = 0.016;            ///< kM, torque about the axis per thrust
  double spin_up_s = 0.0125;                ///< time constant of a rising speed
  double spin_down_s = 0.025;               ///< time constant of a falling speed
  double max_speed_rad_s = 838;             ///< at the battery's nominal voltage
  /// Radius of a rotor: 10 inch propellers.
  static constexpr double kRadius_m = 0.128;
  /// cd in F = -cd W v_perp (rotors_description).
  static constexpr double kDragConstant_n_s2_m = 8.06e-5;
  double thrust_mismatch_ratio = 0.03;  ///< standard deviation of a rotor's constant thrust error
  double thrust_noise_ratio = 0.01;     ///< standard deviation of its varying error
  /// Correlation time of the varying error.
  static constexpr double kThrustNoise_s = 0.1;
  /// Motor controllers hold the commanded speed up to the maximum; otherwise the speed is the commanded one
  /// times voltage over nominal voltage.
  bool speed_governed = true;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"thrust_constant_n_s2", {1e-9, 1}, "thrust of a rotor per squared speed"},
      self.thrust_constant_n_s2);
    v(ParamDoc{"torque_ratio_m", {0, 1}, "torque of a rotor about its axis per thrust"}, self.torque_ratio_m);
    v(ParamDoc{"spin_up_s", {0.002, 1}, "time constant of a rising rotor speed"}, self.spin_up_s);
    v(ParamDoc{"spin_down_s", {0.002, 1}, "time constant of a falling rotor speed"}, self.spin_down_s);
    v(ParamDoc{"max_speed_rad_s", {1, 1e4}, "maximum rotor speed at nominal voltage"}, self.max_speed_rad_s);
  }
};

/// Rigid body of a quadrotor with rotors at the front, left, back and right; front and back turn clockwise
/// seen from above.
struct AirframeParams {
  double mass_kg = 1.387;
  double inertia_xy_kg_m2 = 0.01, inertia_z_kg_m2 = 0.02;  ///< about the centre of mass
  double arm_m = 0.21;                                     ///< from the middle to a rotor's axis
  /// Height of the rotors above the base's origin.
  static constexpr double kRotorHeight_m = 0.03;
  double body_drag_n_s2_m2 = 0.02;  ///< c2 in F = -c2 |v| v
  double com_offset_m = 0.005;      ///< horizontal distance of the centre of mass from the base's origin

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"mass_kg", {0.05, 50}, "mass of the vehicle"}, self.mass_kg);
    v(ParamDoc{"inertia_xy_kg_m2", {1e-5, 10}, "moments of inertia about the x and y axes"},
      self.inertia_xy_kg_m2);
    v(ParamDoc{"inertia_z_kg_m2", {1e-5, 10}, "moment of inertia about the z axis"}, self.inertia_z_kg_m2);
    v(ParamDoc{"arm_m", {0.02, 2}, "distance from the middle to the axis of a rotor"}, self.arm_m);
  }
};

/// Battery of lithium polymer cells in series. Defaults: the Pelican's, 3S 6.25 Ah.
struct BatteryParams {
  int cells = 3;
  double capacity_ah = 6.25;
  double internal_resistance_ohm = 0.025;
  double initial_charge_ratio = 1;
  /// Electric power of computers and sensors.
  static constexpr double kAvionicsPower_w = 15;
  /// Open-circuit voltage of a full and of an empty cell, linear in the charge between them.
  static constexpr double kCellFull_v = 4.2, kCellEmpty_v = 3.4;
  /// Voltage of a cell at which rotors reach RotorParams::max_speed_rad_s.
  static constexpr double kCellNominal_v = 3.7;
  /// Mechanical power of the rotors per electric power.
  static constexpr double kMotorEfficiency = 0.75;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"initial_charge_ratio", {0, 1}, "charge of the battery at the start"},
      self.initial_charge_ratio);
  }
};

/// Wind: turbulence as an Ornstein-Uhlenbeck process on each axis, and horizontal gusts of the form 1 - cos
/// (as in MIL-F-8785C, 3.7.3) from random directions.
struct WindParams {
  double turbulence_m_s = 0.3;  ///< standard deviation on each axis
  /// Correlation time of the turbulence.
  static constexpr double kTurbulenceCorrelation_s = 1.5;
  double gust_m_s = 1.5;  ///< peak speed of a gust
  /// Duration of a gust, from calm to calm.
  static constexpr double kGustDuration_s = 2;
  /// Between the beginnings of two gusts; the first begins at half.
  static constexpr double kGustPeriod_s = 20;
  static constexpr double kFaultGust_m_s = 4;  ///< peak speed of the fault `gust`

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"turbulence_m_s", {0, 20}, "standard deviation of the turbulence on each axis"},
      self.turbulence_m_s);
    v(ParamDoc{"gust_m_s", {0, 20}, "peak speed of the gusts"}, self.gust_m_s);
  }
};

/// Vibration of the rotors in the IMU, its filter and its mounting.
struct VibrationParams {
  double vibration_m_s2 = 1.5;    ///< amplitude of each line in the specific force, at the speed of hovering
  double vibration_rad_s = 0.03;  ///< amplitude of each line in the angular velocity
  double imu_filter_hz = 188;     ///< cut-off of the IMU's second-order low pass, less than 500
  double imu_misalignment_rad = 0.0174533;  ///< angle between the IMU and its nominal orientation
};

/// Reaction of the vehicle's own electronics to a command.
enum class InnerLoopKind {
  kMotors,       ///< commands are rotor speeds
  kSecondOrder,  ///< commands are attitudes, followed with second-order dynamics
  kFirstOrder,   ///< commands are attitudes, followed with first-order dynamics and a gain
};
inline constexpr std::string_view kInnerLoopKindNames[] = {"motors", "second-order", "first-order"};

/// Attitude loops built into a vehicle. First-order defaults: the AscTec Firefly as identified with ETH's
/// mav_system_identification.
struct InnerLoopParams {
  InnerLoopKind inner_loop = InnerLoopKind::kMotors;
  double attitude_time_constant_s = 0.257;  ///< of the first-order loop
  double attitude_gain = 0.75;              ///< reached per commanded angle, first-order loop
  /// Natural frequency and damping of the second-order loop: of a typical autopilot of this size. A vehicle
  /// that was identified has the first-order loop's parameters.
  static constexpr double kAttitudeFrequency_rad_s = 12, kAttitudeDamping_ratio = 0.8;
  /// Time constant of the yaw rate, both loops.
  static constexpr double kYawRateTimeConstant_s = 0.1;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"inner_loop", {}, "what the vehicle does with commands"}, self.inner_loop,
      kInnerLoopKindNames);
    v(ParamDoc{"attitude_time_constant_s", {0.02, 10}, "time constant of the first-order loop"},
      self.attitude_time_constant_s);
    v(ParamDoc{"attitude_gain", {0.1, 10}, "attitude reached per commanded one, first-order loop"},
      self.attitude_gain);
  }
};

/// Parameters of a simulated quadrotor.
struct VehicleParams {
  AirframeParams airframe;
  RotorParams rotor;
  BatteryParams battery;
  WindParams wind;
  VibrationParams vibration;
  InnerLoopParams inner_loop;

  /// Disables disturbances and imperfections of the vehicle: wind, thrust errors, offset of the centre of
  /// mass, vibration and misalignment. Drag, motor lag, battery and contact stay.
  void make_perfect();
  /// Speed of each rotor that carries the vehicle's weight in still air: sqrt(m g / (4 kT)).
  [[nodiscard]] double hover_speed_rad_s() const;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    AirframeParams::visit(self.airframe, v);
    RotorParams::visit(self.rotor, v);
    BatteryParams::visit(self.battery, v);
    WindParams::visit(self.wind, v);
    InnerLoopParams::visit(self.inner_loop, v);
  }
};

}  // namespace hm
