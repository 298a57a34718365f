#include "hm/odometry/registration/surface_following.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

constexpr std::array kGates_m{0.3, 0.15, 0.06, 0.02};  // of the association, in addition to the noise
constexpr int kFollowingIterationsPerGate = 5;
constexpr double kReadingWeight = 0.05;  // readings of one surface are correlated
constexpr double kGuessSigma_m = 0.1,
                 kGuessSigma_rad = 0.05;  // prior for directions that the surfaces leave free
constexpr double kFollowingConverged = 1e-4, kFollowingMaxStep = 0.5;  // m and rad
constexpr double kHeldSigma = 0.03;                                    // m and rad
constexpr double kMinFittingRatio = 0.3;                               // of the elements

Mat6 guess_information() {
  Vec6 sigmas;
  sigmas << Vec3::Constant(kGuessSigma_m), Vec3::Constant(kGuessSigma_rad);
  return sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
}

}  // namespace

std::optional<SurfaceMotion> follow_surface(std::span<const SurfaceElement> reference,
                                            const DepthGrid& current, const SE3& T_ref_cur_guess,
                                            const DepthNoise& noise) {
  const Mat6 prior = guess_information();
  SE3 T_ref_cur = T_ref_cur_guess;
  PoseEquations equations;
  for (const double gate_m : kGates_m) {
    for (int iteration = 0; iteration < kFollowingIterationsPerGate; ++iteration) {
      equations = surface_equations(reference, current, T_ref_cur, {noise, 1, 4, gate_m});
      const Vec6 from_guess = (T_ref_cur_guess.inverse() * T_ref_cur).log();
      const Mat6 information = kReadingWeight * equations.information + prior;
      const Vec6 step =
          -solve_symmetric(information, kReadingWeight * equations.gradient + prior * from_guess);
      if (!step.allFinite() || step.norm() > kFollowingMaxStep) return std::nullopt;
      T_ref_cur = T_ref_cur * SE3::exp(step);
      if (step.lpNorm<Eigen::Infinity>() < kFollowingConverged) break;
    }
  }
  if (equations.terms == 0 || equations.terms < kMinFittingRatio * static_cast<double>(reference.size()))
    return std::nullopt;
  const Vec6 values = symmetric_eigenvalues(Mat6(kReadingWeight * equations.information));
  return SurfaceMotion{T_ref_cur, values[0] > 1 / (kHeldSigma * kHeldSigma)};
}

}  // namespace hm
