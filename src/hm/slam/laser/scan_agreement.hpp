#pragma once
#include <cstddef>

#include "hm/laser/matching/planar_scan.hpp"

namespace hm {

/// How points of scans lie on what other scans measured in their directions.
struct ScanAgreement {
  std::size_t agrees = 0;  ///< points of one scan that lie on what another measured in their direction
  /// Points that another scan saw through: its beam in their direction ended clearly behind them.
  std::size_t seen_through = 0;

  /// 0 where nothing could be compared.
  [[nodiscard]] double contradicted_ratio() const {
    if (seen_through == 0) return 0;
    return static_cast<double>(seen_through) / static_cast<double>(agrees + seen_through);
  }
};

/// Limits by which scans are compared.
struct ScanAgreementLimits {
  /// A beam ends "at" a point within this distance, which grows with the range (heading, spread of the beam).
  double tolerance_m = 0.25, tolerance_ratio = 0.02;
  /// Points farther from either laser than this are not compared: a small error of heading moves them too
  /// far.
  double max_range_m = 10;
  std::size_t max_points = 180;  ///< of each scan, evenly chosen
  /// Points that another scan has so near beside an edge are not compared: a small error of the pose moves a
  /// chair's leg, or the jamb of a door, into the gap beside it.
  double edge_margin_m = 0;
};

/// Adds the points of each of two scans, as the other's laser would see them, to `sum`. Points behind the
/// surface that the other measured are hidden, and those where it measured none (or an edge) unknown: neither
/// counts.
void compare_scans(const PlanarScan& a, const PlanarScan& b, const SE2& T_a_b,
                   const ScanAgreementLimits& limits, ScanAgreement& sum);

}  // namespace hm
