#pragma once
#include <span>
#include <string>

#include "hm/odometry/interface/published_params.hpp"
#include "hm/odometry/published/point_model.hpp"
#include "hm/odometry/registration/rigid_registration.hpp"

namespace hm {

/// Result of the ICP.
struct ModelRegistration {
  bool found = false;
  std::string reason;  ///< explanation when not found
  SE3 T_odom_camera;
  Mat6 covariance = Mat6::Zero();  ///< of T_odom_camera (see RefinedMotion), from the last step's pairs
  int pairs = 0;                   ///< of the last step
  int iterations = 0;
};

/// Registers points in the camera frame to the model by ICP, starting at a predicted pose: pairs by Euclidean
/// distance, each step in closed form. Does not change the model.
ModelRegistration register_to_model(std::span<const UncertainPoint> points_camera, const PointModel& model,
                                    const SE3& predicted_T_odom_camera, const ModelIcpParams& params);

}  // namespace hm
