#pragma once
#include "hm/geometry/camera.hpp"
#include "hm/geometry/se3.hpp"

/// Cameras and extrinsics for the tests of DepthRegistration.
namespace hm::registration_test {

inline const PinholeCamera kDepthCamera{160, 120, 145, 144, 79.2, 61.3, {}};
inline const PinholeCamera kColorCamera{160, 120, 134, 133.5, 80.3, 60.1, {}};
inline const SE3 kMotion(so3_exp(Vec3(0.004, -0.008, 0.002)), Vec3(-0.026, 0.001, 0.0006));

}  // namespace hm::registration_test
