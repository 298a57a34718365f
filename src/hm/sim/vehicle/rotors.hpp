#pragma once
#include <array>
#include <optional>

#include "hm/core/rng.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/sim/vehicle/vehicle_params.hpp"

namespace hm {

inline constexpr std::size_t kRotors = 4;  ///< front, left, back, right

/// One number for each rotor.
using RotorValues = Eigen::Vector4d;

/// Positions of the rotors in the base frame, metres.
std::array<Vec3, kRotors> rotor_positions(const AirframeParams& airframe);
/// Sign of the torque about the body's z axis with which a rotor reacts: +1 for those that turn clockwise
/// seen from above (front, back), -1 for the others.
double rotor_reaction(std::size_t rotor);
/// Matrix from squared rotor speeds (rad^2/s^2) to collective thrust (N) and torques about x, y and z (N m),
/// at rest and with the centre of mass in the middle.
Eigen::Matrix4d rotor_mixing(const AirframeParams& airframe, const RotorParams& rotor);

/// Plane of a surface: a point on it and its unit normal, which faces the vehicle; world frame.
struct SurfacePlane {
  Vec3 point_world = Vec3::Zero();
  Vec3 normal_world = Vec3::UnitZ();
};

/// Surfaces near a rotor's axis; empty: none.
struct RotorSurfaces {
  std::optional<SurfacePlane> below, above;
};

/// Thrust over thrust far from surfaces for a rotor of radius R at distance z from a plane: 1 / (1 -
/// (R/4z)^2) (Cheeseman and Bennett 1955), with z at least R/2.
double ground_effect_factor(double distance_m, double radius_m);
/// Product of the factors of the surfaces below and above a rotor (the latter as mirror image), for a rotor
/// at `position_world` with the unit axis `up_world`.
double surface_effect_factor(const RotorSurfaces& surfaces, const Vec3& position_world, const Vec3& up_world,
                             double radius_m);

/// Errors of the rotors' thrusts: a constant one per rotor, and one that varies as an Ornstein-Uhlenbeck
/// process.
class ThrustErrors {
 public:
  ThrustErrors(const RotorParams& params, std::uint64_t seed);
  /// Advances the varying errors.
  void step(double step_s);
  /// True thrust over nominal thrust of each rotor, 1 + e.
  [[nodiscard]] RotorValues factors() const;

 private:
  RotorParams params_;
  Rng rng_;
  RotorValues mismatch_ = RotorValues::Zero(), noise_ = RotorValues::Zero();
};

}  // namespace hm
