#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "hm/laser/matching/pl_icp_params.hpp"
#include "hm/laser/matching/point_to_line_step.hpp"
#include "hm/laser/matching/reference_lines.hpp"

namespace hm {

/// Correspondences between sensed points and reference lines for one iteration of PL-ICP. Reuses its memory
/// from match to match.
class IcpPairs {
 public:
  static constexpr std::int32_t kUnpaired = -1;

  /// Clears the pairs of the last match.
  void begin(std::size_t sensed_points, std::size_t reference_points);
  /// Pairs every stride-th point of `sensed`, transformed by X, with the nearest reference point, starting
  /// the search at its last partner. Returns the number of pairs.
  std::size_t find(const ReferenceLines& reference, const ScanPoints& sensed, const SE2& X,
                   std::size_t stride, const PlIcpParams& params);
  /// Removes duplicates and trims (Chetverikov 2005, adaptive as in Censi's implementation), keeping all
  /// pairs with an error below floor_m. Returns the number of remaining pairs.
  std::size_t trim(const PlIcpParams& params, double range_sigma_m, double floor_m);
  [[nodiscard]] PointToLineSums sums(const ReferenceLines& reference, const ScanPoints& sensed,
                                     bool weigh) const;
  /// Expected information due to noise of the normals alone.
  [[nodiscard]] Mat3 noise_information(const ReferenceLines& reference, const ScanPoints& sensed,
                                       bool weigh) const;
  /// Hash of the set of pairs, to detect repeated sets.
  [[nodiscard]] std::uint64_t fingerprint() const;
  [[nodiscard]] double mean_error_m() const;
  /// Number of pairs with an error of at most so many metres.
  [[nodiscard]] std::size_t count_within(double error_m) const;

  /// Weight of a pair: inverse variance of its error, in units of the range variance.
  [[nodiscard]] static float weight(const ReferenceLines& reference, std::uint32_t line,
                                    float incidence_cosine, bool weigh) {
    const float reliance = reference.smooth[line] ? 1.0F : kRoughWeight;
    return weigh ? reliance / std::max(incidence_cosine * incidence_cosine, kMinIncidenceCosine2) : reliance;
  }

  struct Pair {
    std::uint32_t point;
    std::uint32_t line;
    float qx, qy;     ///< the rotated point
    float error;      ///< line offset - normal * transformed point
    float distance2;  ///< squared, between the points
  };
  [[nodiscard]] const std::vector<Pair>& pairs() const { return pairs_; }

 private:
  static constexpr float kMinIncidenceCosine2 = 0.2F;
  static constexpr float kRoughWeight = 0.1F;  // of a line that its points contradict
  [[nodiscard]] float trimming_limit(const PlIcpParams& params);

  std::vector<std::int32_t> partner_;  // of every sensed point, from the last iteration that looked at it
  std::vector<float> nearest2_;        // of every reference point
  std::vector<Pair> pairs_;
  std::vector<std::uint16_t> histogram_;  // of the errors, on a logarithmic scale
};

}  // namespace hm
