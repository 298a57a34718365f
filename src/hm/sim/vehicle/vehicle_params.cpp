#include "hm/sim/vehicle/vehicle_params.hpp"

#include <cmath>

#include "hm/sensors/imu.hpp"

namespace hm {

void VehicleParams::make_perfect() {
  airframe.com_offset_m = 0;
  rotor.thrust_mismatch_ratio = rotor.thrust_noise_ratio = 0;
  wind.turbulence_m_s = wind.gust_m_s = 0;
  vibration.vibration_m_s2 = vibration.vibration_rad_s = vibration.imu_misalignment_rad = 0;
}

double VehicleParams::hover_speed_rad_s() const {
  return std::sqrt(airframe.mass_kg * kGravity_m_s2 / (4 * rotor.thrust_constant_n_s2));
}

}  // namespace hm
