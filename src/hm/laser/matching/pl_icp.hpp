#pragma once
#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "hm/laser/matching/pl_icp_params.hpp"
#include "hm/laser/matching/planar_scan.hpp"

namespace hm {

enum class MatchStatus {
  kMatched,
  kTooFewPoints,        ///< one of the scans has too few usable points
  kTooFewPairs,         ///< the scans do not overlap at the guess
  kNoInformation,       ///< pairs that constrain the motion in no direction
  kCorrectionTooLarge,  ///< the result is too far from the guess to be accepted
  kInvalidGuess,        ///< the guess is not finite
};
std::string_view to_string(MatchStatus status);

enum class MatchEnd { kSmallStep, kSamePairs, kMaxIterations };

/// Directions of (x, y, angle) not constrained by a match: along a corridor, around the centre of a round
/// room. The result keeps the initial guess along them.
struct FreeDirections {
  int count = 0;
  /// Unit vectors in (x_m, y_m, angle_rad * arm_m), x and y along the axes of the reference frame.
  std::array<Vec3, 3> directions = {};
  Vec2 at_m = Vec2::Zero();  ///< sensed scan's origin in the reference frame, the centre of rotation
  double arm_m = 1;          ///< converts angles to metres: root mean square range of the pairs

  /// "none", "along 90 deg", "around (1.20, 0.40) m" ...
  [[nodiscard]] std::string to_string() const;
};

/// Variance of a free (unconstrained) direction in `ScanMatch::covariance`, m2.
inline constexpr double kFreeDirectionVariance_m2 = 1e4;

/// Result of matching two scans.
struct ScanMatch {
  MatchStatus status = MatchStatus::kTooFewPoints;
  std::optional<SE2> T_reference_sensed;  ///< set only if the status is kMatched
  /// Covariance of (x, y, angle) of T_reference_sensed: x and y along the axes of the reference's `ortho`
  /// frame, m and rad. Zero if not computed.
  Mat3 covariance = Mat3::Zero();
  int iterations = 0;
  MatchEnd end = MatchEnd::kMaxIterations;
  std::size_t pairs = 0;          ///< used in the last iteration
  std::size_t sensed_points = 0;  ///< usable ones
  double mean_error_m = 0;        ///< mean point-to-line distance of these pairs
  double range_sigma_m = 0;       ///< standard deviation of a range: given or estimated
  FreeDirections free;
  /// Directions that few pairs hold, and those that none do: a few wrong pairs (legs, reveals of other doors)
  /// hold a place along a corridor as firmly as right ones.
  FreeDirections weak;

  [[nodiscard]] bool ok() const { return status == MatchStatus::kMatched; }
};

/// Point-to-line scan matching (PL-ICP; Censi, ICRA 2008; dissertation 2.2.1).
///
/// Every iteration pairs the sensed points with lines of the reference, trims, and computes the rigid
/// transform that minimises the weighted squared point-to-line distances in closed form (translation by Schur
/// complement, rotation by the Lagrange multiplier of c^2 + s^2 = 1). Unconstrained directions are found from
/// the eigenvalues of the information matrix and keep the guess. Covariance: Censi (ICRA 2007), analytic.
///
/// Reuses its working memory: no heap allocation in match() after the first scans of a size. Not thread safe;
/// deterministic.
class PlIcp {
 public:
  /// A direction is held firmly by this share of the pairs, which noise cannot reach; by less, weakly.
  static constexpr double kFirmShare = 0.15;

  explicit PlIcp(const PlIcpParams& params = {});
  ~PlIcp();
  PlIcp(PlIcp&&) noexcept;
  PlIcp& operator=(PlIcp&&) noexcept;

  /// Estimates T_reference_sensed, the pose of `sensed` in the frame of `reference`, from an initial guess.
  ScanMatch match(const PlanarScan& reference, const PlanarScan& sensed, const SE2& T_reference_sensed_guess);

  /// The same in two steps, for matching many scans against one reference.
  void set_reference(const PlanarScan& reference);
  /// A direction that few pairs hold corrects the guess only within the deviations of `guess_covariance`, of
  /// (x, y, angle) along the axes of the reference frame, where it is known; else the direction is free. A
  /// direction that a smaller share of the pairs holds than `least_share` is free too.
  ScanMatch match(const PlanarScan& sensed, const SE2& T_reference_sensed_guess,
                  const std::optional<Mat3>& guess_covariance = {}, double least_share = 0);

  /// Averages the scan of the last successful match() into the reference: every reference point becomes the
  /// mean of up to `max_scans` scans of its surface. Does nothing after a failed match.
  void improve_reference(int max_scans);
  /// Makes the scan of the last successful match() the new reference, in its own frame. Its points inherit
  /// the averages of the old reference (of up to `max_scans` scans) along the lines they were paired with;
  /// `max_scans` 0 or 1: none. After a failed match the scan becomes the reference unchanged.
  void advance_reference(int max_scans);

  [[nodiscard]] const PlIcpParams& params() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hm
