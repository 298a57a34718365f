#include "hm/slam/rgbd/focal_length_check.hpp"

#include <cmath>

namespace hm {
namespace {

/// Error that all pairs share: different pairs of keyframes of a real recording disagree by about this.
constexpr double kFocalSharedSigma = 0.01;
constexpr double kFocalConverged = 1e-3;
constexpr double kFocalUnobservedRatio = 0.5;  // of the prior's deviation

/// x and y of a point that was unprojected with another focal length.
Vec3 shrunk(const Vec3& p, double ratio) { return {p.x() / ratio, p.y() / ratio, p.z()}; }
Vec3 shrunk_by_log_ratio(const Vec3& p) { return {-p.x(), -p.y(), 0}; }

/// With another focal length a plane remains one. `plane_ratio`: length of the plane's vector over that
/// before.
CorrectedElement shrunk(const SurfaceElement& element, double ratio, double& plane_ratio) {
  const Vec3 point = element.point.cast<double>(), normal = element.normal.cast<double>();
  const Vec3 before = normal / normal.dot(point);  // plane . x = 1
  const Vec3 plane(ratio * before.x(), ratio * before.y(), before.z());
  const double size = plane.norm();
  const Vec3 moved = shrunk(point, ratio), turned = -plane / size, by_log_ratio(plane.x(), plane.y(), 0);
  plane_ratio = size / before.norm();
  return {moved, turned, shrunk_by_log_ratio(moved),
          -(by_log_ratio - turned * turned.dot(by_log_ratio)) / size};
}

}  // namespace

std::optional<SurfaceResidual> focal_length_residual(const SurfacePair& pair, const SurfaceElement& element,
                                                     double log_ratio, const DepthNoise& noise) {
  const double ratio = std::exp(log_ratio);
  double enlarged = 1;  // noise along the normal is inverse to the plane's vector
  const CorrectedElement one = shrunk(element, ratio, enlarged);
  const auto reading = reading_at(pair.grid, shrunk(pair.T_grid_element * one.point, 1 / ratio));
  if (!reading) return std::nullopt;
  const Vec3 q = shrunk(pair.grid.camera.unproject(reading->cell, reading->depth_m), ratio);
  SurfaceResidual found = residual_between(one, {q, shrunk_by_log_ratio(q)}, pair.T_grid_element,
                                           {enlarged, 1 - one.normal.z() * one.normal.z()});
  const double cosine = (pair.T_grid_element.rotation() * one.normal).z();
  const double sigma_m = enlarged * noise.sigma_m(reading->depth_m) * cosine,
               own_m = static_cast<double>(element.sigma_m);
  found.variance_m2 = own_m * own_m + sigma_m * sigma_m;
  return found;
}

FocalLengthCheck check_focal_length(std::span<const SurfacePair> pairs, const DepthNoise& noise,
                                    const RunContext& run) {
  const CalibratedQuantity log_ratio{
      focal_length_residual, FocalLengthCheck::kPriorSigma, kFocalSharedSigma, kFocalConverged, 15,
      "focal length"};
  const SurfaceCalibration seen = calibrate_by_surfaces(pairs, log_ratio, noise, run);
  FocalLengthCheck found;
  found.interrupted = seen.interrupted;
  if (seen.interrupted) return found;
  found.pairs = seen.pairs;
  found.is_observed = seen.converged && seen.sigma < kFocalUnobservedRatio * FocalLengthCheck::kPriorSigma;
  found.ratio = std::exp(seen.value);
  found.sigma = seen.sigma;
  found.cost_ratio = seen.cost_ratio;
  return found;
}

}  // namespace hm
