#pragma once
#include <optional>

#include "hm/estimation/filter_types.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {

/// Planar pose of the vehicle from scan matching.
struct PlanarPose {
  Time stamp;  ///< time of measurement, not of arrival
  SE2 T_odom_base;
  std::optional<Mat3> covariance;  ///< of (x, y, yaw) along the axes of `odom`

  [[nodiscard]] PoseReading<double> reading() const { return {stamp, T_odom_base.vector(), covariance}; }
};

/// State of the vehicle at one time, in double precision.
struct VehicleState : BasicVehicleState<double> {
  [[nodiscard]] SE3 T_odom_base() const;
};

}  // namespace hm
