#include "hm/slam/rgbd/disparity_offset.hpp"

#include <cmath>

namespace hm {
namespace {

/// Error that all pairs share: different pairs of keyframes of a real recording disagree by about this.
constexpr double kSharedSigma_1_m = 0.003;
constexpr double kConverged_1_m = 1e-4;
constexpr double kUnobservedRatio = 0.8;  // of the prior's deviation
/// Beyond, surfaces agree worse than without an offset: depth errs in another way. (1.14 in a simulated room
/// whose depth is bent over the image besides; up to 1.02 without any error.)
constexpr double kWorse_ratio = 1.05;

/// In 1/z a plane is linear, and remains so with an offset.
CorrectedElement corrected(const SurfaceElement& element, double offset_1_m) {
  const Vec3 point = element.point.cast<double>(), normal = element.normal.cast<double>();
  const Vec3 plane = normal / normal.dot(point) + offset_1_m * Vec3::UnitZ();  // plane . x = 1
  const double size = plane.norm();
  const Vec3 moved = point / (1 + offset_1_m * point.z()), turned = -plane / size;
  return {moved, turned, -moved.z() * moved, -(Vec3::UnitZ() - turned * turned.z()) / size};
}

}  // namespace

std::optional<SurfaceResidual> offset_residual(const SurfacePair& pair, const SurfaceElement& element,
                                               double offset_1_m, const DepthNoise& noise) {
  const CorrectedElement one = corrected(element, offset_1_m);
  const std::optional<GridReading> reading = reading_at(pair.grid, pair.T_grid_element * one.point);
  if (!reading) return std::nullopt;
  const double scale = 1 + offset_1_m * reading->depth_m, z = reading->depth_m / scale;
  const Vec3 q = pair.grid.camera.unproject(reading->cell, z);
  SurfaceResidual found = residual_between(one, {q, -z * q}, pair.T_grid_element, {scale * scale, 2 * z});
  const double cosine = (pair.T_grid_element.rotation() * one.normal).z();
  const double sigma_m = noise.sigma_m(reading->depth_m) * cosine,
               own_m = static_cast<double>(element.sigma_m);
  found.variance_m2 = own_m * own_m + sigma_m * sigma_m;
  return found;
}

DisparityOffset estimate_disparity_offset(std::span<const SurfacePair> pairs, const DepthNoise& noise,
                                          const RunContext& run) {
  const CalibratedQuantity offset{
      offset_residual,      DisparityOffset::kPriorSigma_1_m, kSharedSigma_1_m, kConverged_1_m, 5,
      "offset of disparity"};
  const SurfaceCalibration seen = calibrate_by_surfaces(pairs, offset, noise, run);
  DisparityOffset found;
  found.interrupted = seen.interrupted;
  if (seen.interrupted) return found;
  found.pairs = seen.pairs;
  found.is_observed = seen.converged && seen.sigma < kUnobservedRatio * DisparityOffset::kPriorSigma_1_m &&
                      seen.cost_ratio < kWorse_ratio;
  if (!found.is_observed) return found;
  found.offset_1_m = seen.value;
  found.sigma_1_m = seen.sigma;
  found.cost_ratio = seen.cost_ratio;
  return found;
}

}  // namespace hm
