#pragma once
#include "hm/geometry/se2.hpp"

namespace hm {

/// Covariance of (x, y, angle) of T_a_c = T_a_b * T_b_c for independent T_a_b and T_b_c; each covariance is
/// along the axes of the left frame of its transform (a, b; result a).
Mat3 compose_covariance(const SE2& T_a_b, const Mat3& covariance_a_b, const SE2& T_b_c,
                        const Mat3& covariance_b_c);

/// The same covariance of (x, y, angle), given along the axes of a frame b, along those of a.
Mat3 turned_covariance(const Mat2& R_a_b, const Mat3& covariance_b);

/// Covariance of two independent measurements taken together, (a^-1 + b^-1)^-1, for positive definite b; a
/// may be singular or very large in some directions.
Mat3 fused_covariance(const Mat3& a, const Mat3& b);

}  // namespace hm
