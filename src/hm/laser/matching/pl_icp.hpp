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
  kNoInformation,       ///< pairs, but no direction in which they fix the motion
  kCorrectionTooLarge,  ///< the result is too far from the guess to be accepted
  kInvalidGuess,        ///< the guess is not finite
};
std::string_view to_string(MatchStatus status);

enum class MatchEnd { kSmallStep, kSamePairs, kMaxIterations };

/// Directions of (x, y, angle) in which two scans can be shifted against each other without any change:
/// along a corridor, around the centre of a round room. The motion keeps the guess along them.
struct FreeDirections {
  int count = 0;
  /// Unit vectors in (x_m, y_m, angle_rad * arm_m), x and y along the axes of the reference frame.
  std::array<Vec3, 3> directions = {};
  Vec2 at_m = Vec2::Zero();  ///< the sensed scan's origin in the reference frame: angles are turned about it
  double arm_m = 1;          ///< turns angles into metres: root mean square range of the pairs

  /// "none", "along 90 deg", "around (1.20, 0.40) m" ...
  [[nodiscard]] std::string to_string() const;
};

/// The variance that `ScanMatch::covariance` gives a free direction (m2): nothing is known of it.
inline constexpr double kFreeDirectionVariance_m2 = 1e4;

/// What the matching of two scans gave.
struct ScanMatch {
  MatchStatus status = MatchStatus::kTooFewPoints;
  std::optional<SE2> T_reference_sensed;  ///< nothing unless the status is kMatched
  /// Of (x, y, angle) of T_reference_sensed: x and y along the axes of the reference's `ortho` frame. Zero
  /// when not wanted.
  Mat3 covariance = Mat3::Zero();
  int iterations = 0;
  MatchEnd end = MatchEnd::kMaxIterations;
  std::size_t pairs = 0;          ///< that the last iteration used
  std::size_t sensed_points = 0;  ///< usable ones
  double mean_error_m = 0;        ///< mean distance from line of these pairs
  double range_sigma_m = 0;       ///< noise of a range: given, or as estimated
  FreeDirections free;

  [[nodiscard]] bool ok() const { return status == MatchStatus::kMatched; }
};

/// Point-to-line scan matching (PL-ICP; Censi, ICRA 2008; dissertation 2.2.1).
///
/// Every iteration pairs the sensed points with lines of the reference, trims, and solves for the rigid
/// motion that minimises the weighted squared distances from the lines, exactly (translation by Schur
/// complement, rotation by the Lagrange multiplier of c^2 + s^2 = 1). Directions without information are
/// found from the eigenvalues of the information matrix and keep the guess. Covariance: Censi (ICRA 2007),
/// analytic.
///
/// Holds its working memory: no heap in match() once it has seen scans of the size. Not thread safe;
/// deterministic.
class PlIcp {
 public:
  explicit PlIcp(const PlIcpParams& params = {});
  ~PlIcp();
  PlIcp(PlIcp&&) noexcept;
  PlIcp& operator=(PlIcp&&) noexcept;

  /// Where the frame of `sensed` lies in the frame of `reference`.
  ScanMatch match(const PlanarScan& reference, const PlanarScan& sensed, const SE2& T_reference_sensed_guess);

  /// match() in two parts, for matching many scans against one reference.
  void set_reference(const PlanarScan& reference);
  ScanMatch match(const PlanarScan& sensed, const SE2& T_reference_sensed_guess);

  /// Lets the scan of the last successful match() improve the reference: every reference point becomes the
  /// mean of what at most `max_scans` scans saw of its surface. Nothing after a failed match.
  void improve_reference(int max_scans);
  /// Makes the scan of the last successful match() the reference, in its own frame. Its points take over,
  /// along the lines they were paired with, what the old reference had learned from up to `max_scans` scans;
  /// `max_scans` 0 or 1: nothing. After a failed match the scan is taken as it is.
  void advance_reference(int max_scans);

  [[nodiscard]] const PlIcpParams& params() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hm
