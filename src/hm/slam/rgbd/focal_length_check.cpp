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

/// An element as it is with another focal length: a plane remains one.
struct ShrunkElement {
  Vec3 point, normal, normal_by_log_ratio;
  double enlarged = 1;  ///< noise along the normal before, over noise after
};
ShrunkElement shrunk(const SurfaceElement& element, double ratio) {
  const Vec3 point = element.point.cast<double>(), normal = element.normal.cast<double>();
  const Vec3 before = normal / normal.dot(point);  // plane . x = 1
  const Vec3 plane(ratio * before.x(), ratio * before.y(), before.z());
  const double size = plane.norm();
  const Vec3 turned = -plane / size, by_log_ratio(plane.x(), plane.y(), 0);
  return {shrunk(point, ratio), turned, -(by_log_ratio - turned * turned.dot(by_log_ratio)) / size,
          size / before.norm()};
}

}  // namespace

std::optional<SurfaceResidual> focal_length_residual(const SurfacePair& pair, const SurfaceElement& element,
                                                     double log_ratio, const DepthNoise& noise) {
  constexpr double kInFront_m = 0.05;
  const double ratio = std::exp(log_ratio);
  const ShrunkElement one = shrunk(element, ratio);
  const Mat3& R = pair.T_grid_element.rotation();
  const Vec3 p = pair.T_grid_element * one.point;
  if (p.z() < kInFront_m) return std::nullopt;
  const Vec2 pixel = pair.grid.camera.project(shrunk(p, 1 / ratio));
  const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
  if (!pair.grid.depth_m.contains(x, y) || !(pair.grid.depth_m(x, y) > 0)) return std::nullopt;
  const double z = static_cast<double>(pair.grid.depth_m(x, y));
  const Vec3 q = shrunk(pair.grid.camera.unproject(Vec2(x, y), z), ratio), n = R * one.normal;
  const double distance_m = n.dot(q - p);
  const double sigma_m = one.enlarged * noise.sigma_m(z) * n.z(),
               own_m = static_cast<double>(element.sigma_m);
  const Vec3 q_by_log_ratio(-q.x(), -q.y(), 0), point_by_log_ratio(-one.point.x(), -one.point.y(), 0);
  const double by_log_ratio = n.dot(q_by_log_ratio - R * point_by_log_ratio) +
                              (R * one.normal_by_log_ratio).dot(q - p) +
                              distance_m * (1 - one.normal.z() * one.normal.z());
  SurfaceResidual found;
  found.distance_m = one.enlarged * distance_m;
  found.variance_m2 = own_m * own_m + sigma_m * sigma_m;
  found.jacobian << -one.enlarged * n, -one.enlarged * q.cross(n), one.enlarged * by_log_ratio;
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
