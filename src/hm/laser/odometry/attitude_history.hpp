#pragma once
#include <optional>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Recent orientations of the vehicle, interpolated at any time in between.
///
/// Not thread safe.
class AttitudeHistory {
 public:
  /// Orientations older than `keep_s` before the newest are dropped; times farther than `max_gap_s` from the
  /// nearest orientation have no result.
  explicit AttitudeHistory(double keep_s = 2.0, double max_gap_s = 0.05)
      : keep_(Duration::from_seconds(keep_s)), max_gap_(Duration::from_seconds(max_gap_s)) {}

  /// Adds R_world_base at `stamp`. Returns false without change when the stamp is not later than the newest
  /// one or the matrix is not finite.
  bool add(Time stamp, const Mat3& R_world_base);
  /// R_world_base at `stamp`, by slerp between the neighbouring orientations; beyond either end of the
  /// history, the last orientation there.
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
