#include "hm/sim/vehicle/rotors.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

constexpr std::uint64_t kThrustErrorStream = 0x746872;

/// Distance along a unit direction to a plane; nothing when the plane is parallel or behind.
std::optional<double> distance_along(const Vec3& from, const Vec3& direction, const SurfacePlane& plane) {
  const double along = direction.dot(plane.normal_world);
  if (along > -1e-3) return std::nullopt;
  return std::max(0.0, (plane.point_world - from).dot(plane.normal_world) / along);
}

}  // namespace

std::array<Vec3, kRotors> rotor_positions(const AirframeParams& airframe) {
  const double arm = airframe.arm_m, height = airframe.kRotorHeight_m;
  return {Vec3(arm, 0, height), Vec3(0, arm, height), Vec3(-arm, 0, height), Vec3(0, -arm, height)};
}

double rotor_reaction(std::size_t rotor) { return rotor % 2 == 0 ? 1 : -1; }

Eigen::Matrix4d rotor_mixing(const AirframeParams& airframe, const RotorParams& rotor) {
  const auto positions = rotor_positions(airframe);
  Eigen::Matrix4d mixing;
  for (std::size_t i = 0; i < kRotors; ++i)
    mixing.col(static_cast<Eigen::Index>(i)) =
        rotor.thrust_constant_n_s2 *
        Eigen::Vector4d(1, positions[i].y(), -positions[i].x(), rotor_reaction(i) * rotor.torque_ratio_m);
  return mixing;
}

double ground_effect_factor(double distance_m, double radius_m) {
  const double ratio = radius_m / (4 * std::max(distance_m, radius_m / 2));
  return 1 / (1 - ratio * ratio);
}

double surface_effect_factor(const RotorSurfaces& surfaces, const Vec3& position_world, const Vec3& up_world,
                             double radius_m) {
  double factor = 1;
  if (surfaces.below)
    if (const auto distance_m = distance_along(position_world, -up_world, *surfaces.below))
      factor *= ground_effect_factor(*distance_m, radius_m);
  if (surfaces.above)
    if (const auto distance_m = distance_along(position_world, up_world, *surfaces.above))
      factor *= ground_effect_factor(*distance_m, radius_m);
  return factor;
}

ThrustErrors::ThrustErrors(const RotorParams& params, std::uint64_t seed)
    : params_(params), rng_(seed, kThrustErrorStream) {
  for (double& e : mismatch_) e = rng_.normal(0, params.thrust_mismatch_ratio);
  for (double& e : noise_) e = rng_.normal(0, params.thrust_noise_ratio);
}

void ThrustErrors::step(double step_s) {
  const double keep = std::exp(-step_s / params_.kThrustNoise_s);
  const double fresh = params_.thrust_noise_ratio * std::sqrt(1 - keep * keep);
  for (double& e : noise_) e = keep * e + rng_.normal(0, fresh);
}

RotorValues ThrustErrors::factors() const {
  return (1 + mismatch_.array() + noise_.array()).max(0.0).matrix();
}

}  // namespace hm
