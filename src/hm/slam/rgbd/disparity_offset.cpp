#include "hm/slam/rgbd/disparity_offset.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

using Vec7 = Eigen::Matrix<double, 7, 1>;
using Mat7 = Eigen::Matrix<double, 7, 7>;

constexpr double kOffsetReadingShare = 0.03;  // readings of a surface are correlated
// Motions are nearly free: with 0.02 m and 0.01 rad, poses of odometry hold the offset near zero (0.011 found
// of 0.020 in a simulated room, 0.018 with these).
constexpr double kPairSigma_m = 0.1, kPairSigma_rad = 0.05;
constexpr std::size_t kMostIterations = 5;
constexpr int kMotionSteps = 4;
constexpr double kConverged_1_m = 1e-4, kMaxMotionStep = 0.3;  // metres and radians
constexpr double kCauchySigmas = 2, kGateSigmas = 4;
constexpr double kWideGate_m = 0.03, kGate_m = 0.01;  // of the association, besides the noise
constexpr std::size_t kLeastPairedPoints = 100;
constexpr double kLeastPairedRatio = 0.3;
/// Error that all pairs share, as by a distortion over the image: different pairs of keyframes of a real
/// recording disagree by about this.
constexpr double kSharedSigma_1_m = 0.003;
constexpr double kUnobservedRatio = 0.8;  // of the prior's deviation
/// Beyond, surfaces agree worse than without an offset: depth errs in another way. (1.14 in a simulated room
/// whose depth is bent over the image besides; up to 1.02 without any error.)
constexpr double kWorse_ratio = 1.05;

/// An element as it is with an offset. In 1/z a plane is linear, and remains so.
struct CorrectedElement {
  Vec3 point, normal, normal_by_offset;
};
CorrectedElement corrected(const SurfaceElement& element, double offset_1_m) {
  const Vec3 point = element.point.cast<double>(), normal = element.normal.cast<double>();
  const Vec3 plane = normal / normal.dot(point) + offset_1_m * Vec3::UnitZ();  // plane . x = 1
  const double size = plane.norm();
  const Vec3 turned = -plane / size;
  return {point / (1 + offset_1_m * point.z()), turned, -(Vec3::UnitZ() - turned * turned.z()) / size};
}

/// Normal equations of a pair.
struct PairEquations {
  Mat7 information = Mat7::Zero();
  Vec7 gradient = Vec7::Zero();
  double cost = 0;
  std::size_t terms = 0;
};

PairEquations equations_of(const SurfacePair& pair, double offset_1_m, const DepthNoise& noise,
                           double gate_m) {
  PairEquations sums;
  for (const SurfaceElement& element : pair.elements) {
    const auto seen = offset_residual(pair, element, offset_1_m, noise);
    const double sigma_m = seen ? std::sqrt(seen->variance_m2) : 0;
    if (!seen || std::abs(seen->distance_m) > kGateSigmas * sigma_m + gate_m) continue;
    const double normalised = seen->distance_m / (kCauchySigmas * sigma_m);
    const double weight = kOffsetReadingShare / ((1 + normalised * normalised) * seen->variance_m2);
    sums.information += weight * seen->jacobian * seen->jacobian.transpose();
    sums.gradient += weight * seen->distance_m * seen->jacobian;
    sums.cost += std::log1p(normalised * normalised);
    ++sums.terms;
  }
  return sums;
}

/// Equation of a pair for the offset alone: its motion has been eliminated.
struct OffsetEquation {
  double information = 0, gradient = 0, cost = 0;
};

/// A pair whose motion follows the offset.
class MovingPair {
 public:
  explicit MovingPair(const SurfacePair& pair) : pair_(pair), guess_(pair.T_grid_element) {
    prior_ << Vec3::Constant(1 / (kPairSigma_m * kPairSigma_m)),
        Vec3::Constant(1 / (kPairSigma_rad * kPairSigma_rad));
  }
  [[nodiscard]] std::uint32_t group() const { return pair_.group; }

  /// Nothing if the images do not show enough of the same surfaces.
  std::optional<OffsetEquation> equation_at(double offset_1_m, const DepthNoise& noise) {
    PairEquations equations;
    for (int step = 0;; ++step) {
      equations = equations_of(pair_, offset_1_m, noise, is_near_ ? kGate_m : kWideGate_m);
      const Vec6 from_guess = (pair_.T_grid_element * guess_.inverse()).log();
      equations.information.topLeftCorner<6, 6>().diagonal() += prior_;
      equations.gradient.head<6>() += prior_.cwiseProduct(from_guess);
      if (step == kMotionSteps) break;
      const Mat6 information = equations.information.topLeftCorner<6, 6>();
      const Vec6 move = -solve_symmetric(information, Vec6(equations.gradient.head<6>()));
      if (!move.allFinite() || move.norm() > kMaxMotionStep) return std::nullopt;
      pair_.T_grid_element = SE3::exp(move) * pair_.T_grid_element;
      is_near_ |= step + 2 == kMotionSteps;
    }
    if (equations.terms < kLeastPairedPoints ||
        static_cast<double>(equations.terms) < kLeastPairedRatio * static_cast<double>(pair_.elements.size()))
      return std::nullopt;
    const Mat6 information = equations.information.topLeftCorner<6, 6>();
    const Vec6 cross = equations.information.topRightCorner<6, 1>();
    const Vec6 carried = solve_symmetric(information, cross);
    return OffsetEquation{equations.information(6, 6) - cross.dot(carried),
                          equations.gradient[6] - carried.dot(equations.gradient.head<6>()),
                          equations.cost / static_cast<double>(equations.terms)};
  }

 private:
  SurfacePair pair_;
  SE3 guess_;
  Vec6 prior_;
  bool is_near_ = false;
};

/// Sums of the pairs' equations at an offset, with the prior.
struct OffsetEquations {
  double information = 0, gradient = 0, cost = 0;
  std::size_t pairs = 0;
  std::map<std::uint32_t, double> gradient_of_group;

  [[nodiscard]] double sigma_1_m(double prior_information) const {
    double squares = prior_information;
    for (const auto& [group, sum] : gradient_of_group) squares += sum * sum;
    return std::hypot(kSharedSigma_1_m,
                      std::max(std::sqrt(squares) / information, 1 / std::sqrt(information)));
  }
};

/// Progress of `iteration` is that of its pairs. Nothing if the run is stopped.
std::optional<OffsetEquations> sum_equations(std::vector<MovingPair>& pairs, double offset_1_m,
                                             double prior_information, const DepthNoise& noise,
                                             std::size_t iteration, const RunContext& run) {
  OffsetEquations sums;
  std::size_t done = iteration * pairs.size();
  sums.information = prior_information;
  sums.gradient = prior_information * offset_1_m;
  for (MovingPair& pair : pairs) {
    if (run.progress) run.progress({"offset of disparity", done++, kMostIterations * pairs.size(), {}});
    if (run.stop.stop_requested()) return std::nullopt;
    const std::optional<OffsetEquation> equation = pair.equation_at(offset_1_m, noise);
    if (!equation) continue;
    ++sums.pairs;
    sums.information += equation->information;
    sums.gradient += equation->gradient;
    sums.gradient_of_group[pair.group()] += equation->gradient;
    sums.cost += equation->cost;
  }
  if (sums.pairs > 0) sums.cost /= static_cast<double>(sums.pairs);
  return sums;
}

}  // namespace

std::optional<OffsetResidual> offset_residual(const SurfacePair& pair, const SurfaceElement& element,
                                              double offset_1_m, const DepthNoise& noise) {
  constexpr double kInFront_m = 0.05;
  const CorrectedElement one = corrected(element, offset_1_m);
  const Mat3& R = pair.T_grid_element.rotation();
  const Vec3 p = pair.T_grid_element * one.point;
  if (p.z() < kInFront_m) return std::nullopt;
  const Vec2 pixel = pair.grid.camera.project(p);
  const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
  if (!pair.grid.depth_m.contains(x, y) || !(pair.grid.depth_m(x, y) > 0)) return std::nullopt;
  const double reading_m = static_cast<double>(pair.grid.depth_m(x, y));
  const double z = reading_m / (1 + offset_1_m * reading_m);
  const Vec3 q = pair.grid.camera.unproject(Vec2(x, y), z), n = R * one.normal;
  const double distance_m = n.dot(q - p);
  const double sigma_m = noise.sigma_m(reading_m) * n.z(), own_m = static_cast<double>(element.sigma_m);
  const double enlarged = (1 + offset_1_m * reading_m) * (1 + offset_1_m * reading_m);
  OffsetResidual found;
  found.distance_m = enlarged * distance_m;
  found.variance_m2 = own_m * own_m + sigma_m * sigma_m;
  found.jacobian << -enlarged * n, -enlarged * q.cross(n),
      enlarged * (n.dot(one.point.z() * (R * one.point) - z * q) + (R * one.normal_by_offset).dot(q - p) +
                  2 * z * distance_m);
  return found;
}

DisparityOffset estimate_disparity_offset(std::span<const SurfacePair> pairs, const DepthNoise& noise,
                                          const RunContext& run) {
  constexpr double kPriorInformation =
      1 / (DisparityOffset::kPriorSigma_1_m * DisparityOffset::kPriorSigma_1_m);
  std::vector<MovingPair> moving(pairs.begin(), pairs.end());
  DisparityOffset found;
  double offset_1_m = 0, first_cost = 0;
  bool converged = false;
  for (std::size_t iteration = 0; iteration < kMostIterations; ++iteration) {
    const std::optional<OffsetEquations> sums =
        sum_equations(moving, offset_1_m, kPriorInformation, noise, iteration, run);
    if (!sums) {
      DisparityOffset stopped;
      stopped.interrupted = true;
      return stopped;
    }
    if (iteration == 0) first_cost = sums->cost;
    const double step_1_m = -sums->gradient / sums->information;
    found.pairs = sums->pairs;
    found.sigma_1_m = sums->sigma_1_m(kPriorInformation);
    found.cost_ratio = first_cost > 0 ? sums->cost / first_cost : 1;
    offset_1_m += step_1_m;
    converged = std::abs(step_1_m) < kConverged_1_m;
    if (converged) break;
  }
  found.is_observed = converged && found.sigma_1_m < kUnobservedRatio * DisparityOffset::kPriorSigma_1_m &&
                      found.cost_ratio < kWorse_ratio;
  if (found.is_observed)
    found.offset_1_m = offset_1_m;
  else
    found.sigma_1_m = DisparityOffset::kPriorSigma_1_m, found.cost_ratio = 1;
  return found;
}

}  // namespace hm
