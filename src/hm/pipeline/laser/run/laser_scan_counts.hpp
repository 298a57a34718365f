#pragma once
#include <optional>
#include <vector>

#include "hm/pipeline/common/run_records.hpp"
#include "hm/pipeline/laser/run/laser_summary.hpp"

namespace hm {

/// Numbers of all scans of a run, counted while they come, so that those of a long run do not depend on which
/// records are kept.
class LaserScanCounts {
 public:
  /// `truth`: true poses, by which heights are judged; may be empty. It must outlive this.
  explicit LaserScanCounts(const Trajectory& truth) : truth_(truth) {}
  void add(const LaserScanRecord& record);

  /// Cost of the frame `map`, a scan.
  [[nodiscard]] Summary map_frame_ms() const { return map_frame_ms_.summary(); }
  /// All but the map.
  [[nodiscard]] LocalisationSummary localisation() const;
  /// Heights against the truth's z at their stamps, a constant offset (median) taken away; nothing when there
  /// are fewer than three that can be compared.
  [[nodiscard]] std::optional<HeightError> height_error() const;

 private:
  void add_place(const LaserScanRecord& record);
  void add_height(const HeightEstimate& height);

  const Trajectory& truth_;
  LocalisationSummary localisation_;
  RunningSummary map_frame_ms_, score_, correction_m_;
  std::optional<SE2> T_map_odom_last_;  ///< of the last located scan
  std::vector<double> height_differences_m_;
};

}  // namespace hm
