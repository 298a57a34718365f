#pragma once
#include <span>
#include <string>

#include "hm/odometry/published/point_model.hpp"
#include "hm/odometry/registration/rigid_registration.hpp"

namespace hm {

/// Iterative closest point of a frame's features against the model, as published (Besl and McKay 1992;
/// dissertation 3.2). The limits of the published code were commented as "1 mm, 1 degree" and were a tenth.
struct ModelIcpParams {
  int max_icp_iterations = 10;
  double max_pair_distance_m = 0.15;
  int min_pairs = 15;
  double converged_m = 1e-4;
  double converged_rad = 1.7e-3;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"max_icp_iterations", {1, 1000}, "ICP: steps at most"}, self.max_icp_iterations);
    v(ParamDoc{"max_pair_distance_m", {1e-3, 10}, "ICP: farther model points are not paired"},
      self.max_pair_distance_m);
    v(ParamDoc{"min_pairs", {3, 10000}, "ICP: fewer pairs are a failure"}, self.min_pairs);
    v(ParamDoc{"converged_m", {0, 1}, "ICP: ends when a step moves less and ..."}, self.converged_m);
    v(ParamDoc{"converged_rad", {0, 1}, "... ICP: turns less"}, self.converged_rad);
  }
};

/// The answer of an ICP.
struct ModelRegistration {
  bool found = false;
  std::string reason;  ///< in words, with numbers, when not found
  SE3 T_odom_camera;
  Mat6 covariance = Mat6::Zero();  ///< of T_odom_camera (see RefinedMotion), from the last step's pairs
  int pairs = 0;                   ///< of the last step
  int iterations = 0;
};

/// Moves points in the camera frame onto the model, starting at a predicted pose: pairs by Euclidean
/// distance, each step in closed form. The model is not changed.
ModelRegistration register_to_model(std::span<const UncertainPoint> points_camera, const PointModel& model,
                                    const SE3& predicted_T_odom_camera, const ModelIcpParams& params);

}  // namespace hm
