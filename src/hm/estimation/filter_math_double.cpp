#include "hm/estimation/filter_math.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {

Mat3 rotation_from_angles(const Vec3& roll_pitch_yaw_rad) {
  return rotation_from_roll_pitch_yaw(roll_pitch_yaw_rad);
}
Vec3 angles_of(const Mat3& rotation) { return roll_pitch_yaw(rotation); }

Eigen::Quaterniond turned(const Eigen::Quaterniond& rotation, const Vec3& vector) {
  const double angle = vector.norm();
  // sin(a/2)/a by its series where the quotient loses digits.
  const double scale = angle < 1e-4 ? 0.5 - angle * angle / 48 : std::sin(0.5 * angle) / angle;
  const Vec3 v = scale * vector;
  return (rotation * Eigen::Quaterniond(std::cos(0.5 * angle), v.x(), v.y(), v.z())).normalized();
}

Eigen::Quaterniond shortest_turn(const Vec3& from, const Vec3& to) { return turn_between(from, to); }

}  // namespace hm
