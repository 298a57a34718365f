#pragma once
#include <array>
#include <cstdint>

#include "hm/geometry/occupancy.hpp"
#include "hm/mvog/mvog_params.hpp"

namespace hm::mvog {

/// Evidence of a run in one byte: hits in the high half, misses in the low half, together at most 15; 0 is
/// unknown. Two values that are no valid counters mark levels that beams only brushed or ended beside.
using RunCode = std::uint8_t;
inline constexpr int kMaxEvidence = 15;
inline constexpr RunCode kUnknownCode = 0;
inline constexpr RunCode kNearFreeCode = 0xf1;      ///< a beam brushed it
inline constexpr RunCode kNearOccupiedCode = 0xf2;  ///< a beam ended just beside it

constexpr RunCode make_code(int hits, int misses) { return static_cast<RunCode>(hits << 4 | misses); }
constexpr int hits_of(RunCode code) { return code >> 4; }
constexpr int misses_of(RunCode code) { return code & 15; }
/// True for counters (also unknown).
constexpr bool is_counter(RunCode code) { return hits_of(code) + misses_of(code) <= kMaxEvidence; }
constexpr bool is_valid_code(RunCode code) {
  return is_counter(code) || code == kNearFreeCode || code == kNearOccupiedCode;
}

/// Look-up tables of all functions of codes and parameters.
class CodeTables {
 public:
  explicit CodeTables(const MvogParams& params);

  [[nodiscard]] Occupancy state(RunCode code) const { return state_[code]; }
  /// New code by observation: 0 none, 1 brushed, 2 ended beside, 3 missed, 4 hit. The highest observation of
  /// a scan counts.
  using Step = std::array<RunCode, 256>;
  using Steps = std::array<Step, 5>;
  /// `same_view`: the scan is from the position of a recent scan.
  [[nodiscard]] const Steps& steps(bool same_view) const { return step_[same_view]; }
  /// True when two codes both have only hits or only misses, and their counts do not differ significantly.
  [[nodiscard]] bool similar(RunCode a, RunCode b) const { return similar_[a][b >> 6] >> (b & 63) & 1u; }
  /// Common code of two similar runs, weighted by their lengths.
  [[nodiscard]] RunCode merged(RunCode a, int length_a, RunCode b, int length_b) const;
  /// Probability hits / (hits + misses); 0 and 1 for levels brushed or ended beside.
  [[nodiscard]] static double probability(RunCode code);

 private:
  void make_states(double occupied_ratio);
  void make_steps(const MvogParams& params);
  void make_similar(double sigmas);

  std::array<Occupancy, 256> state_{};
  std::array<Steps, 2> step_{};
  std::array<std::array<std::uint64_t, 4>, 256> similar_{};
};

}  // namespace hm::mvog
