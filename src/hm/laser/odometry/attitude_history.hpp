#pragma once
#include <optional>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Orientations of the vehicle over the last moments, for asking what it was at any time in between.
///
/// Not thread safe.
class AttitudeHistory {
 public:
  /// Orientations older than `keep_s` before the newest are forgotten; a moment further than `max_gap_s`
  /// from its nearest orientation has no answer.
  explicit AttitudeHistory(double keep_s = 2.0, double max_gap_s = 0.05)
      : keep_(Duration::from_seconds(keep_s)), max_gap_(Duration::from_seconds(max_gap_s)) {}

  /// Takes R_world_base at `stamp`. False, and nothing changed, when the stamp is not later than the newest
  /// one or the matrix is not finite.
  bool add(Time stamp, const Mat3& R_world_base);
  /// R_world_base at `stamp`: along the great arc between the two orientations around it; beyond either end
  /// of the history, the end's orientation.
  [[nodiscard]] std::optional<Mat3> at(Time stamp) const;

  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  void clear() { entries_.clear(); }

 private:
  struct Entry {
    Time stamp;
    Eigen::Quaterniond q_world_base;
  };
  std::vector<Entry> entries_;  // by stamp
  Duration keep_, max_gap_;
};

}  // namespace hm
