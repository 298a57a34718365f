#include "hm/slam/rgbd/surface_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

using Vec7 = Eigen::Matrix<double, 7, 1>;
using Mat7 = Eigen::Matrix<double, 7, 7>;

constexpr double kCalibrationReadingShare = 0.03;  // readings of a surface are correlated
// Motions are nearly free: with 0.02 m and 0.01 rad, poses of odometry hold the offset of disparity near zero
// (0.011 found of 0.020 in a simulated room, 0.018 with these).
constexpr double kPairSigma_m = 0.1, kPairSigma_rad = 0.05;
constexpr int kMotionSteps = 4;
constexpr double kMaxMotionStep = 0.3;  // metres and radians
constexpr double kCauchySigmas = 2, kGateSigmas = 4;
constexpr double kWideGate_m = 0.03, kGate_m = 0.01;  // of the association, besides the noise
constexpr std::size_t kLeastPairedPoints = 100;
constexpr double kLeastPairedRatio = 0.3;

/// Normal equations of a pair.
struct PairEquations {
  Mat7 information = Mat7::Zero();
  Vec7 gradient = Vec7::Zero();
  double cost = 0;
  std::size_t terms = 0;
};

PairEquations equations_of(const SurfacePair& pair, double value, const CalibratedQuantity& quantity,
                           const DepthNoise& noise, double gate_m) {
  PairEquations sums;
  for (const SurfaceElement& element : pair.elements) {
    const auto seen = quantity.residual(pair, element, value, noise);
    const double sigma_m = seen ? std::sqrt(seen->variance_m2) : 0;
    if (!seen || std::abs(seen->distance_m) > kGateSigmas * sigma_m + gate_m) continue;
    const double normalised = seen->distance_m / (kCauchySigmas * sigma_m);
    const double weight = kCalibrationReadingShare / ((1 + normalised * normalised) * seen->variance_m2);
    sums.information += weight * seen->jacobian * seen->jacobian.transpose();
    sums.gradient += weight * seen->distance_m * seen->jacobian;
    sums.cost += std::log1p(normalised * normalised);
    ++sums.terms;
  }
  return sums;
}

/// Equation of a pair for the quantity alone: its motion has been eliminated.
struct QuantityEquation {
  double information = 0, gradient = 0, cost = 0;
};

/// A pair whose motion follows the quantity.
class MovingPair {
 public:
  explicit MovingPair(const SurfacePair& pair) : pair_(pair), guess_(pair.T_grid_element) {
    prior_ << Vec3::Constant(1 / (kPairSigma_m * kPairSigma_m)),
        Vec3::Constant(1 / (kPairSigma_rad * kPairSigma_rad));
  }
  [[nodiscard]] std::uint32_t group() const { return pair_.group; }

  /// Nothing if the images do not show enough of the same surfaces.
  std::optional<QuantityEquation> equation_at(double value, const CalibratedQuantity& quantity,
                                              const DepthNoise& noise) {
    PairEquations equations;
    for (int step = 0;; ++step) {
      equations = equations_of(pair_, value, quantity, noise, is_near_ ? kGate_m : kWideGate_m);
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
    return QuantityEquation{equations.information(6, 6) - cross.dot(carried),
                            equations.gradient[6] - carried.dot(equations.gradient.head<6>()),
                            equations.cost / static_cast<double>(equations.terms)};
  }

 private:
  SurfacePair pair_;
  SE3 guess_;
  Vec6 prior_;
  bool is_near_ = false;
};

/// Sums of the pairs' equations at a value, with the prior.
struct QuantityEquations {
  double information = 0, gradient = 0, cost = 0;
  std::size_t pairs = 0;
  std::map<std::uint32_t, double> gradient_of_group;

  [[nodiscard]] double sigma(double prior_information, double shared_sigma) const {
    double squares = prior_information;
    for (const auto& [group, sum] : gradient_of_group) squares += sum * sum;
    return std::hypot(shared_sigma, std::max(std::sqrt(squares) / information, 1 / std::sqrt(information)));
  }
};

/// Progress of `iteration` is that of its pairs. Nothing if the run is stopped.
std::optional<QuantityEquations> sum_equations(std::vector<MovingPair>& pairs, double value,
                                               const CalibratedQuantity& quantity, const DepthNoise& noise,
                                               std::size_t iteration, const RunContext& run) {
  QuantityEquations sums;
  std::size_t done = iteration * pairs.size();
  sums.information = quantity.prior_information();
  sums.gradient = quantity.prior_information() * value;
  for (MovingPair& pair : pairs) {
    if (run.progress) run.progress({quantity.stage, done++, quantity.most_iterations * pairs.size(), {}});
    if (run.stop.stop_requested()) return std::nullopt;
    const std::optional<QuantityEquation> equation = pair.equation_at(value, quantity, noise);
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

SurfaceResidual residual_between(const CorrectedElement& element, const CorrectedReading& reading,
                                 const SE3& T_grid_element, const NoiseEnlargement& enlarged) {
  const Mat3& R = T_grid_element.rotation();
  const Vec3 n = R * element.normal, apart = reading.point - T_grid_element * element.point;
  const double distance_m = n.dot(apart);
  const double by_value = n.dot(reading.point_by_value - R * element.point_by_value) +
                          (R * element.normal_by_value).dot(apart) + enlarged.log_by_value * distance_m;
  SurfaceResidual found;
  found.distance_m = enlarged.ratio * distance_m;
  found.jacobian << -enlarged.ratio * n, -enlarged.ratio * reading.point.cross(n), enlarged.ratio * by_value;
  return found;
}

SurfaceCalibration calibrate_by_surfaces(std::span<const SurfacePair> pairs,
                                         const CalibratedQuantity& quantity, const DepthNoise& noise,
                                         const RunContext& run) {
  std::vector<MovingPair> moving(pairs.begin(), pairs.end());
  SurfaceCalibration found;
  double first_cost = 0;
  for (std::size_t i = 0; i < quantity.most_iterations && !found.converged; ++i) {
    const auto sums = sum_equations(moving, found.value, quantity, noise, i, run);
    if (!sums) {
      found.interrupted = true;
      return found;
    }
    if (i == 0) first_cost = sums->cost;
    const double step = -sums->gradient / sums->information;
    found.pairs = sums->pairs;
    found.sigma = sums->sigma(quantity.prior_information(), quantity.shared_sigma);
    found.cost_ratio = first_cost > 0 ? sums->cost / first_cost : 1;
    found.value += step;
    found.converged = std::abs(step) < quantity.least_step;
  }
  return found;
}

}  // namespace hm
