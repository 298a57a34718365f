#include "hm/odometry/geometry_tracking/reference_registration.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/odometry/geometry_tracking/surface_reference.hpp"

namespace hm {
namespace {

constexpr std::array kNearGates_m{0.06, 0.03, 0.01, 0.0}, kFarGates_m{0.3, 0.12, 0.04, 0.0};
constexpr int kIterationsPerGate = 4;
constexpr int kComparedCells = 2, kJudgedCells = 4;  // every n-th in both directions
constexpr double kCorrelation = 0.05;                // of readings of one surface, as in surface_following
// Errors of one depth image against another that no number of readings reduces: distortion, sensor's steps.
constexpr double kImageSigma_m = 0.002, kImageSigma_rad = 0.001;
// Mean square of the error of a normal at a depth of 1 m (rad^2). A Kinect's noise of 1.4 mm, halved by the
// mean of four pixels, over a window of 5 x 5 cells of 7.6 mm: (0.7 / (7.6 * sqrt(50)))^2 = 0.00017. Noise
// grows with the square of the depth, the window with the depth. With 0.0005, fast turns over the desk of
// tum_fr1_rpy (tuning half, 50 frames without colour) slid by 20 cm along it; with this by 9.
constexpr double kNormalVariance_m2 = 0.0002;
constexpr int kComparedNormals = 4;      // every n-th cell in both directions
constexpr double kSameNormal = 0.87;     // cosine of the angle up to which two normals may be of one surface
constexpr double kSameNormalSigmas = 4;  // and their distance
constexpr std::size_t kLeastNormals = 30;
constexpr double kConfirmedSigmas = 2;  // of the sum of both, beyond which it is no chance
// Errors that two images share, as their steps of disparity lie alike, relative to those that they do not. Of
// what seems to hold the camera along a simulated blank wall, up to a third is in both.
constexpr double kErrorsOfBoth = 0.5;
constexpr double kStill = 3e-5, kNearlyStill = 5e-4, kLongestStep = 0.5;  // m and rad
constexpr double kFittingSigmas = 3, kFitting_m = 0.01;

Mat6 image_covariance() {
  Vec6 sigmas;
  sigmas << Vec3::Constant(kImageSigma_m), Vec3::Constant(kImageSigma_rad);
  return sigmas.cwiseAbs2().asDiagonal();
}

/// The part of the equations that is left when the reference's own pose has this covariance (perturbation in
/// the current camera's frame) and is eliminated.
Mat6 damping_by(const Mat6& information, const Mat6& covariance) {
  const Mat6 loose = inverse_of(covariance);
  return loose * inverse_of(information + loose);
}

struct RegistrationSums {
  Mat6 information = Mat6::Zero(), exact_information = Mat6::Zero(), covariance = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();
  double weight = 0;
};

RegistrationSums compare_with_all(std::span<const ReferenceSurface> references, const DepthGrid& current,
                                  std::span<const SurfaceElement> normals, const SE3& T,
                                  const SurfaceMatching& matching, double depth_m) {
  RegistrationSums sums;
  const Mat6 of_image = image_covariance();
  for (const ReferenceSurface& reference : references) {
    const SE3 T_ref_cur = reference.T_odom_depth.inverse() * T;
    PoseEquations equations = surface_equations(*reference.surface, current, T_ref_cur, matching);
    equations.information *= kCorrelation;
    equations.gradient *= kCorrelation;
    equations =
        without_normal_noise(equations, compare_normals(*reference.surface, normals, T_ref_cur), depth_m);
    const Mat6 damping = damping_by(equations.information,
                                    covariance_by_adjoint(reference.covariance, T.inverse()) + of_image);
    const Mat6 held = damping * equations.information;
    sums.information += held;
    sums.gradient += damping * equations.gradient;
    sums.exact_information += damping_by(equations.information, of_image) * equations.information;
    sums.covariance += held.trace() * reference.covariance;
    sums.weight += held.trace();
  }
  return sums;
}

/// Element of a surface at a point of its camera's frame; null if there is none.
const SurfaceElement* element_of(const SurfaceGrid& surface, const Vec3& p) {
  const auto pixel = nearest_pixel(surface.camera, p);
  if (!pixel || !surface.elements.contains(pixel->x(), pixel->y())) return nullptr;
  const SurfaceElement& element = surface.elements(pixel->x(), pixel->y());
  return element.sigma_m > 0 ? &element : nullptr;
}

void judge(std::span<const ReferenceSurface> references, const DepthGrid& current, const DepthNoise& noise,
           ReferenceRegistration& result) {
  int readings = 0, compared = 0, fitting = 0;
  std::vector<SE3> T_ref_cur;
  for (const ReferenceSurface& reference : references)
    T_ref_cur.push_back(reference.T_odom_depth.inverse() * result.T_odom_depth);
  for (int y = kJudgedCells / 2; y < current.depth_m.height(); y += kJudgedCells)
    for (int x = kJudgedCells / 2; x < current.depth_m.width(); x += kJudgedCells) {
      const double z = static_cast<double>(current.depth_m(x, y));
      if (!(z > 0)) continue;
      ++readings;
      const Vec3 p = current.camera.unproject(Vec2(x, y), z);
      bool is_compared = false, fits = false;
      for (std::size_t i = 0; i < references.size() && !fits; ++i) {
        const Vec3 p_ref = T_ref_cur[i] * p;
        const SurfaceElement* element = element_of(*references[i].surface, p_ref);
        if (!element) continue;
        is_compared = true;
        const double residual = element->normal.cast<double>().dot(p_ref - element->point.cast<double>());
        const double sigma = std::hypot(static_cast<double>(element->sigma_m), noise.sigma_m(z));
        fits = std::abs(residual) < kFittingSigmas * sigma + kFitting_m;
      }
      compared += is_compared ? 1 : 0;
      fitting += fits ? 1 : 0;
    }
  if (readings > 0) result.compared_ratio = static_cast<double>(compared) / readings;
  if (compared > 0) result.fitting_ratio = static_cast<double>(fitting) / compared;
}

}  // namespace

NormalComparison compare_normals(const SurfaceGrid& surface, std::span<const SurfaceElement> current,
                                 const SE3& T_surface_current) {
  const Mat3 R_current_surface = T_surface_current.rotation().transpose();
  NormalComparison sums;
  for (const SurfaceElement& element : current) {
    const Vec3 p = element.point.cast<double>(), normal = element.normal.cast<double>();
    const Vec3 p_surface = T_surface_current * p;
    const SurfaceElement* other = element_of(surface, p_surface);
    if (!other) continue;
    const Vec3 other_normal = R_current_surface * other->normal.cast<double>();
    const double distance = other->normal.cast<double>().dot(p_surface - other->point.cast<double>());
    const double sigma_m = std::hypot(element.sigma_m, other->sigma_m);
    if (normal.dot(other_normal) < kSameNormal || std::abs(distance) > kSameNormalSigmas * sigma_m) continue;
    Vec6 by_surface, by_image;
    by_surface << other_normal, p.cross(other_normal);
    by_image << normal, p.cross(normal);
    const double weight = 1 / (sigma_m * sigma_m);
    sums.by_one += weight * by_surface * by_surface.transpose();
    const Mat6 by_both = weight * by_surface * by_image.transpose();
    sums.by_both += 0.5 * (by_both + by_both.transpose());
    ++sums.normals;
  }
  return sums;
}

PoseEquations without_normal_noise(const PoseEquations& equations, const NormalComparison& normals,
                                   double depth_m) {
  Vec6 unit;  // rotations as metres at the depth of the scene
  unit << Vec3::Ones(), Vec3::Constant(1 / depth_m);
  const Eigen6 held = symmetric_eigen(Mat6(unit.asDiagonal() * equations.information * unit.asDiagonal()));
  const double noise = kNormalVariance_m2 * depth_m * depth_m * held.values[5];
  Vec6 left, share;
  for (int i = 0; i < 6; ++i) {
    left[i] = std::max(0.0, held.values[i] - noise);
    const Vec6 direction = unit.asDiagonal() * held.vectors.col(i);
    const double by_one = direction.dot(normals.by_one * direction);
    if (normals.normals >= kLeastNormals && by_one > 0) {
      const double by_both = direction.dot(normals.by_both * direction);
      const double noise_of_one = std::max(0.0, by_one - by_both);
      const double chance = kConfirmedSigmas / std::sqrt(static_cast<double>(normals.normals));
      const double confirmed = (by_both - (kErrorsOfBoth + chance) * noise_of_one) / by_one;
      left[i] = std::min(left[i], held.values[i] * std::clamp(confirmed, 0.0, 1.0));
    }
    share[i] = left[i] > 0 ? left[i] / held.values[i] : 0;
  }
  const Vec6 in_metres = unit.cwiseInverse();
  PoseEquations out = equations;
  out.information = in_metres.asDiagonal() * held.vectors * left.asDiagonal() * held.vectors.transpose() *
                    in_metres.asDiagonal();
  out.gradient = in_metres.asDiagonal() *
                 (held.vectors * (share.asDiagonal() *
                                  (held.vectors.transpose() * (unit.asDiagonal() * equations.gradient))));
  return out;
}

ReferenceRegistration register_to_references(std::span<const ReferenceSurface> references,
                                             const DepthGrid& current,
                                             const PoseVelocityFilter::Prediction& prediction,
                                             RegistrationReach reach, const DepthNoise& noise) {
  const Mat6 prior = inverse_of(prediction.covariance);
  const double depth_m = mean_depth_m(current);
  const std::vector<SurfaceElement> normals = sample_surface(current, noise, kComparedNormals);
  ReferenceRegistration result{prediction.T_odom_camera};
  RegistrationSums sums;
  for (const double gate_m : reach == RegistrationReach::kNear ? kNearGates_m : kFarGates_m)
    for (int iteration = 0; iteration < kIterationsPerGate; ++iteration) {
      sums = compare_with_all(references, current, normals, result.T_odom_depth,
                              {noise, kComparedCells, 4, gate_m}, depth_m);
      const Vec6 from_prediction = (prediction.T_odom_camera.inverse() * result.T_odom_depth).log();
      const Vec6 step = -solve_symmetric(sums.information + prior, sums.gradient + prior * from_prediction);
      if (!step.allFinite() || step.norm() > kLongestStep) return {prediction.T_odom_camera};
      result.T_odom_depth = result.T_odom_depth * SE3::exp(step);
      if (step.lpNorm<Eigen::Infinity>() < (gate_m > 0 ? kNearlyStill : kStill)) break;
    }
  result.information = 0.5 * (sums.exact_information + sums.exact_information.transpose());
  if (sums.weight > 0) result.reference_covariance = sums.covariance / sums.weight;
  judge(references, current, noise, result);
  return result;
}

}  // namespace hm
