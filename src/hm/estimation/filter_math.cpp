#include "hm/estimation/filter_math.hpp"

#include "hm/geometry/float/attitude.hpp"

namespace hm {

float wrap_angle(float angle_rad) {
  const float wrapped = wrap_angle_f(angle_rad);
  return wrapped == -kPiF ? kPiF : wrapped;
}

FilterMatrix<float, 3> rotation_from_angles(const FilterVector<float, 3>& roll_pitch_yaw_rad) {
  const auto [sr, cr] = sin_cos_f(roll_pitch_yaw_rad.x());
  const auto [sp, cp] = sin_cos_f(roll_pitch_yaw_rad.y());
  const auto [sy, cy] = sin_cos_f(roll_pitch_yaw_rad.z());
  FilterMatrix<float, 3> rotation;
  rotation << cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,  //
      sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,          //
      -sp, cp * sr, cp * cr;
  return rotation;
}

FilterVector<float, 3> angles_of(const FilterMatrix<float, 3>& rotation) {
  const float level = norm_f(rotation(0, 0), rotation(1, 0));
  return {atan2_f(rotation(2, 1), rotation(2, 2)), atan2_f(-rotation(2, 0), level),
          atan2_f(rotation(1, 0), rotation(0, 0))};
}

namespace {

FilterQuaternion<float> quaternion_of(const Attitude& attitude) {
  const Attitude unit = normalised(attitude);
  return {unit.w, unit.x, unit.y, unit.z};
}

}  // namespace

FilterQuaternion<float> turned(const FilterQuaternion<float>& rotation,
                               const FilterVector<float, 3>& vector) {
  // Written out in Attitude: Eigen's product of floats is another sum on every CPU.
  return quaternion_of(Attitude{rotation.w(), rotation.x(), rotation.y(), rotation.z()} *
                       attitude_turned_by(vector));
}

FilterQuaternion<float> shortest_turn(const FilterVector<float, 3>& from, const FilterVector<float, 3>& to) {
  const Vec3f a = from / norm_f(from), b = to / norm_f(to);
  const float w = 1.0F + dot_f(a, b);
  if (w < 1e-6F) {  // half a turn about any axis across
    const Vec3f axis = cross_f(a, std::abs(a.x()) < 0.6F ? Vec3f(1, 0, 0) : Vec3f(0, 1, 0));
    return quaternion_of({0, axis.x(), axis.y(), axis.z()});
  }
  const Vec3f axis = cross_f(a, b);
  return quaternion_of({w, axis.x(), axis.y(), axis.z()});
}

}  // namespace hm
