#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "hm/core/run_context.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/odometry/registration/surface_grid.hpp"

namespace hm {

/// Two depth images of the same surfaces. Referenced objects must outlive it.
struct SurfacePair {
  std::span<const SurfaceElement> elements;  ///< of the one, as read
  const DepthGrid& grid;                     ///< the other, as read
  SE3 T_grid_element;                        ///< motion between them, approximate
  std::uint32_t group = 0;                   ///< pairs of one group may have the same error
};

/// Distance of an element from what a depth image reads in its place, both corrected by a value.
struct SurfaceResidual {
  /// Along the normal, enlarged as noise is by the correction: a value that makes all surfaces smaller would
  /// otherwise make noise smaller.
  double distance_m = 0;
  double variance_m2 = 0;
  /// By the motion (T_grid_element <- exp(x) T_grid_element) and by the value.
  Eigen::Matrix<double, 7, 1> jacobian = Eigen::Matrix<double, 7, 1>::Zero();
};

/// An element as a value corrects it, with the derivatives.
struct CorrectedElement {
  Vec3 point, normal;  ///< normal: unit length
  Vec3 point_by_value, normal_by_value;
};
/// A point that a depth image reads, as the value corrects it.
struct CorrectedReading {
  Vec3 point, point_by_value;
};
/// By how much noise along the normal was larger before the correction.
struct NoiseEnlargement {
  double ratio = 1, log_by_value = 0;
};
/// Distance between both with its derivatives; the variance is left to the caller.
SurfaceResidual residual_between(const CorrectedElement& element, const CorrectedReading& reading,
                                 const SE3& T_grid_element, const NoiseEnlargement& enlarged);

/// A number in the model of a depth camera, 0 if the model is right.
struct CalibratedQuantity {
  /// Nothing where the image has no reading.
  std::function<std::optional<SurfaceResidual>(const SurfacePair&, const SurfaceElement&, double value,
                                               const DepthNoise&)>
      residual;
  double prior_sigma = 1;    ///< of a prior with mean zero
  double shared_sigma = 0;   ///< of an error that all pairs share, as by a distortion over the image
  double least_step = 1e-4;  ///< of an iteration, less has converged
  std::size_t most_iterations = 5;
  std::string stage;  ///< of the progress
  [[nodiscard]] double prior_information() const { return 1 / (prior_sigma * prior_sigma); }
};

struct SurfaceCalibration {
  double value = 0, sigma = 0;
  std::size_t pairs = 0;  ///< that were compared
  /// Mean robust cost (Cauchy) of the distances between the surfaces, with the value over with zero, each
  /// with its own motions.
  double cost_ratio = 1;
  bool converged = false, interrupted = false;
};

/// Self-calibration of a depth camera: surfaces that are seen from different places have one shape only with
/// the right model. Least squares over the value and the motion of every pair, which is free: poses of
/// odometry, which a wrong model has spoiled, do not count, nor do colour images. The deviation is the larger
/// one of what noise and what the disagreement of the groups explain. Deterministic. Reports progress per
/// pair and iteration; if `run` is stopped, ends before the next pair.
SurfaceCalibration calibrate_by_surfaces(std::span<const SurfacePair> pairs,
                                         const CalibratedQuantity& quantity, const DepthNoise& noise,
                                         const RunContext& run = {});

}  // namespace hm
