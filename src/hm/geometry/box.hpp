#pragma once
#include <Eigen/Geometry>

namespace hm {
/// Axis-aligned box, metres; empty when default-constructed.
using Box3 = Eigen::AlignedBox3d;
}  // namespace hm
