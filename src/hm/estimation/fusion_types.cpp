#include "hm/estimation/fusion_types.hpp"

namespace hm {

SE3 VehicleState::T_odom_base() const {
  return {rotation_from_roll_pitch_yaw(roll_pitch_yaw_rad), position_m};
}

}  // namespace hm
