#include "hm/slam/rgbd/keyframe_surfaces.hpp"

#include <algorithm>
#include <cmath>

#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/odometry/registration/surface_alignment.hpp"

namespace hm {
namespace {

constexpr int kSurfaceStride = 4;         // in cells of DepthGrid: about 1,000 elements of a VGA image
constexpr double kSurfaceMaxDepth_m = 5;  // beyond, a Kinect's noise is over 4 cm
constexpr double kReadingShare = 0.03;    // readings of one surface are correlated, as in the tracker
// Error that all readings of two depth images share (distortion of depth, registration in time).
constexpr double kSharedSigma_m = 0.003, kSharedSigma_rad = 0.002;
// Prior around the guess: directions that the surfaces leave free stay there.
constexpr double kGuessSigma_m = 0.02, kGuessSigma_rad = 0.01;
constexpr int kFactorIterations = 8, kWideIterations = 3;
constexpr double kFactorWideGate_m = 0.03, kFactorGate_m = 0.01;  // of the association, besides the noise
constexpr double kFactorConverged = 1e-5, kMaxFactorStep = 0.3;   // metres and radians
constexpr double kLeastFoundRatio = 0.3;
constexpr std::size_t kLeastPoints = 100;
constexpr double kHidden_m = 0.1;

Vec6 precision(double sigma_m, double sigma_rad) {
  Vec6 values;
  values << Vec3::Constant(1 / (sigma_m * sigma_m)), Vec3::Constant(1 / (sigma_rad * sigma_rad));
  return values;
}

/// Information with a further independent error, (H^-1 + E)^-1 = H - H (H + E^-1)^-1 H, for any H.
Mat6 with_error(const Mat6& H, const Vec6& error_precision) {
  Mat6 sum = H;
  sum.diagonal() += error_precision;
  const Mat6 reduced = H - H * inverse_of(sum) * H;
  return 0.5 * (reduced + reduced.transpose());
}

/// Distance along its normal of an element from what a depth image reads in its place; nothing if it is not
/// in the image.
std::optional<double> distance_m(const SurfaceElement& element, const DepthGrid& grid,
                                 const SE3& T_grid_element) {
  const Vec3 p = T_grid_element * element.point.cast<double>();
  const std::optional<GridReading> reading = reading_at(grid, p);
  if (!reading) return std::nullopt;
  const Vec3 seen = grid.camera.unproject(reading->cell, reading->depth_m);
  return std::abs((T_grid_element.rotation() * element.normal.cast<double>()).dot(seen - p));
}

double cauchy(double distance, double sigma) {
  const double normalised = distance / (2 * sigma);
  return std::log1p(normalised * normalised);
}

}  // namespace

KeyframeSurfaces::KeyframeSurfaces(const PinholeCamera& camera,
                                   std::span<const std::shared_ptr<const Keyframe>> keyframes,
                                   const KeyframeDepths& depths, const RunContext& run)
    : noise_(depths.noise), surfaces_(keyframes.size()) {
  for (std::size_t i = 0; depths.read && i < keyframes.size(); ++i) {
    if (run.progress) run.progress({"surfaces of keyframes", i, keyframes.size(), {}});
    const std::optional<KeyframeDepth> read = depths.read(*keyframes[i]);
    if (!read || read->depth.width() != camera.width || read->depth.height() != camera.height) continue;
    Surface& surface = surfaces_[i].emplace();
    surface.grid = make_depth_grid(read->depth, camera, noise_, kSurfaceMaxDepth_m);
    surface.elements = sample_surface(surface.grid, noise_, kSurfaceStride);
    surface.T_camera_depth = read->T_camera_depth;
  }
}

std::optional<PoseEdge3D> KeyframeSurfaces::factor(std::uint32_t a, std::uint32_t b, const SE3& T_a_b) const {
  if (!surfaces_[a] || !surfaces_[b]) return std::nullopt;
  const Surface &reference = *surfaces_[a], &current = *surfaces_[b];
  const Vec6 prior = precision(kGuessSigma_m, kGuessSigma_rad);
  const SE3 guess = reference.T_camera_depth.inverse() * T_a_b * current.T_camera_depth;
  SE3 T = guess;
  PoseEquations equations;
  for (int i = 0; i < kFactorIterations; ++i) {
    const double gate_m = i < kWideIterations ? kFactorWideGate_m : kFactorGate_m;
    equations = surface_equations(reference.elements, current.grid, T, {noise_, 1, 4, gate_m});
    Mat6 information = kReadingShare * equations.information;
    information.diagonal() += prior;
    const Vec6 from_guess = (guess.inverse() * T).log();
    const Vec6 step =
        -solve_symmetric(information, kReadingShare * equations.gradient + prior.cwiseProduct(from_guess));
    if (!step.allFinite() || step.norm() > kMaxFactorStep) return std::nullopt;
    T = T * SE3::exp(step);
    if (step.lpNorm<Eigen::Infinity>() < kFactorConverged) break;
  }
  const double found = equations.terms;
  if (found < kLeastPoints || found < kLeastFoundRatio * static_cast<double>(reference.elements.size()))
    return std::nullopt;
  const Mat6 information =
      with_error(kReadingShare * equations.information, precision(kSharedSigma_m, kSharedSigma_rad));
  const Mat6 to_depth = adjoint(current.T_camera_depth.inverse());
  return PoseEdge3D{a, b, reference.T_camera_depth * T * current.T_camera_depth.inverse(),
                    to_depth.transpose() * information * to_depth, PoseEdgeKind::kOdometry};
}

void KeyframeSurfaces::compare(const KeyframePair& pair, std::span<const SE3> T_map_camera,
                               std::span<const SE3> T_map_other, SurfaceAgreement& sums) const {
  const auto& [a, b] = pair;
  if (!surfaces_[a] || !surfaces_[b]) return;
  const Surface &reference = *surfaces_[a], &current = *surfaces_[b];
  const auto between = [&](std::span<const SE3> T) {
    return (T[b] * current.T_camera_depth).inverse() * (T[a] * reference.T_camera_depth);
  };
  const SE3 T_b_a = between(T_map_camera), T_b_a_other = between(T_map_other);
  SurfaceAgreement view;
  std::size_t points = 0;
  for (const SurfaceElement& element : reference.elements) {
    const auto one = distance_m(element, current.grid, T_b_a),
               other = distance_m(element, current.grid, T_b_a_other);
    if (!one || !other || *one > kHidden_m || *other > kHidden_m) continue;
    const double sigma_m = std::sqrt(2.0) * static_cast<double>(element.sigma_m);  // of two readings
    ++points;
    view.distance_m += *one, view.other_distance_m += *other;
    view.cost += cauchy(*one, sigma_m), view.other_cost += cauchy(*other, sigma_m);
  }
  if (points < kLeastPoints) return;
  const double share = 1 / static_cast<double>(points);
  ++sums.views;
  sums.distance_m += share * view.distance_m, sums.other_distance_m += share * view.other_distance_m;
  sums.cost += share * view.cost, sums.other_cost += share * view.other_cost;
}

SurfaceAgreement KeyframeSurfaces::agreement(std::span<const KeyframePair> pairs,
                                             std::span<const SE3> T_map_camera,
                                             std::span<const SE3> T_map_other) const {
  SurfaceAgreement means;
  for (const auto& [a, b] : pairs) {
    compare({a, b}, T_map_camera, T_map_other, means);
    compare({b, a}, T_map_camera, T_map_other, means);
  }
  const double share = means.views == 0 ? 0 : 1 / static_cast<double>(means.views);
  for (double* sum : {&means.distance_m, &means.other_distance_m, &means.cost, &means.other_cost})
    *sum *= share;
  return means;
}

std::vector<SurfacePair> KeyframeSurfaces::surface_pairs(std::span<const KeyframePair> pairs,
                                                         std::span<const SE3> T_map_camera) const {
  std::vector<SurfacePair> compared;
  for (const auto& [a, b] : pairs) {
    if (!surfaces_[a] || !surfaces_[b]) continue;
    const SE3 T_map_a = T_map_camera[a] * surfaces_[a]->T_camera_depth,
              T_map_b = T_map_camera[b] * surfaces_[b]->T_camera_depth;
    compared.push_back({surfaces_[a]->elements, surfaces_[b]->grid, T_map_b.inverse() * T_map_a, a});
  }
  return compared;
}

DisparityOffset KeyframeSurfaces::disparity_offset(std::span<const KeyframePair> pairs,
                                                   std::span<const SE3> T_map_camera,
                                                   const RunContext& run) const {
  return estimate_disparity_offset(surface_pairs(pairs, T_map_camera), noise_, run);
}

FocalLengthCheck KeyframeSurfaces::focal_length(std::span<const KeyframePair> pairs,
                                                std::span<const SE3> T_map_camera,
                                                const RunContext& run) const {
  return check_focal_length(surface_pairs(pairs, T_map_camera), noise_, run);
}

}  // namespace hm
