#include "hm/tsdf/alignment/alignment_step.hpp"

#include <algorithm>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

/// d(xi) / d(shift; turn * arm).
Vec6 turn_scale(double arm_m) {
  Vec6 scale = Vec6::Ones();
  scale.tail<3>().setConstant(1.0 / arm_m);
  return scale;
}

}  // namespace

SE3 TurningCentre::moved(const SE3& T_world_camera, const Vec6& xi) const {
  const SE3 motion = SE3::exp(xi);
  return {motion.rotation() * T_world_camera.rotation(),
          motion * (T_world_camera.translation() - p_world) + p_world};
}

Vec6 TurningCentre::between(const SE3& T_world_from, const SE3& T_world_to) const {
  const SE3 motion = T_world_to * T_world_from.inverse();
  return SE3(motion.rotation(), motion * p_world - p_world).log();
}

Mat6 TurningCentre::to_origin() const {
  Mat6 jacobian = Mat6::Identity();
  jacobian.topRightCorner<3, 3>() = skew(p_world);
  return jacobian;
}

Observability observability(const Mat6& H, double weight, double arm_m, double min_share) {
  Observability seen;
  if (!(weight > 0) || !H.allFinite()) return seen;
  const Vec6 scale = turn_scale(arm_m);
  const Mat6 scaled = scale.asDiagonal() * H * scale.asDiagonal() / weight;
  const Eigen3 shifts = symmetric_eigen(Mat3(scaled.topLeftCorner<3, 3>()));
  seen.free_shifts = static_cast<int>((shifts.values.array() < min_share).count());
  // The free shifts are known; their coupling with the rest is noise. Computes the eigenvectors of the rest.
  Mat6 basis = Mat6::Identity();
  basis.topLeftCorner<3, 3>() = shifts.vectors;
  Mat6 rest = basis.transpose() * scaled * basis;
  for (int i = 0; i < seen.free_shifts; ++i) {
    rest.row(i).setZero(), rest.col(i).setZero();
    rest(i, i) = shifts.values[i] - 1e3;  // before all others
  }
  const Eigen6 solved = symmetric_eigen(rest);
  seen.share = solved.values;
  seen.share.head(seen.free_shifts).array() += 1e3;
  seen.directions = basis * solved.vectors;
  seen.unobservable = static_cast<int>((seen.share.array() < min_share).count());
  return seen;
}

SE3 Observability::held(const SE3& T_world_camera, const SE3& T_world_prior) const {
  Vec3 t = T_world_camera.translation();
  for (int i = 0; i < free_shifts; ++i) {
    const Vec3 axis = directions.col(i).head<3>();
    t -= axis * axis.dot(T_world_camera.translation() - T_world_prior.translation());
  }
  return {T_world_camera.rotation(), t};
}

Information observable_part(const Information& geometry, const Observability& seen, double arm_m) {
  if (seen.unobservable == 0) return geometry;
  const Vec6 scale = turn_scale(arm_m);
  const auto basis = seen.directions.rightCols(6 - seen.unobservable);
  const Mat6 projection = scale.asDiagonal() * basis * basis.transpose() * scale.cwiseInverse().asDiagonal();
  return {projection.transpose() * geometry.H * projection, projection.transpose() * geometry.b};
}

Vec6 damped_step(const Information& information, double damping) {
  Mat6 H = information.H;
  H.diagonal() *= 1.0 + damping;
  return -solve_symmetric(H, information.b);
}

Mat6 covariance_at_origin(const Mat6& information, const TurningCentre& centre) {
  const Eigen6 solved = symmetric_eigen(information);
  const Vec6 variances = solved.values.cwiseMax(1e-12).cwiseInverse();
  const Mat6 about_centre = solved.vectors * variances.asDiagonal() * solved.vectors.transpose();
  const Mat6 jacobian = centre.to_origin();
  return jacobian * about_centre * jacobian.transpose();
}

}  // namespace hm
