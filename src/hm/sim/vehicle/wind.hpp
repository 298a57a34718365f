#pragma once
#include <optional>

#include "hm/core/rng.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/sim/vehicle/vehicle_params.hpp"

namespace hm {

/// Gust of the form v(t) = (peak / 2) (1 - cos(2 pi t / duration)) along a horizontal direction.
struct WindGust {
  double begin_s = 0, duration_s = 1, peak_m_s = 0;
  double direction_rad = 0;  ///< in which the air moves, from the x axis
  [[nodiscard]] Vec3 velocity_world_m_s(double time_s) const;
};

/// Wind at the vehicle: an Ornstein-Uhlenbeck process on each axis (standard deviation s, correlation time t,
/// power spectral density 2 s^2 t / (1 + (w t)^2)) plus gusts at equal intervals from random directions. The
/// same seed gives the same wind.
class WindModel {
 public:
  WindModel(const WindParams& params, std::uint64_t seed);

  /// Advances the time; the turbulence is exact for any step.
  void step(double step_s);
  /// Begins an additional gust (the fault `gust`) of peak speed WindParams::kFaultGust_m_s now; its direction
  /// follows from the seed and the time. One gust at a time: a new one replaces it.
  void begin_gust(double duration_s);
  /// Velocity of the air.
  [[nodiscard]] Vec3 velocity_world_m_s() const;

 private:
  /// The periodic gust that begins last before the present time, if one has begun.
  [[nodiscard]] std::optional<WindGust> periodic_gust() const;
  [[nodiscard]] double direction_rad(std::uint64_t stream) const;

  WindParams params_;
  std::uint64_t seed_;
  Rng rng_;
  double time_s_ = 0;
  Vec3 turbulence_ = Vec3::Zero();
  std::optional<WindGust> fault_gust_;
};

}  // namespace hm
