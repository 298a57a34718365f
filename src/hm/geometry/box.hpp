#pragma once
#include <Eigen/Geometry>

namespace hm {
/// An axis-aligned box, metres; empty until something extends it.
using Box3 = Eigen::AlignedBox3d;
}  // namespace hm
