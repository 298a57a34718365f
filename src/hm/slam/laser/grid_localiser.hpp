#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <string_view>

#include "hm/core/params.hpp"
#include "hm/geometry/occupancy_grid_2d.hpp"
#include "hm/laser/matching/planar_scan.hpp"
#include "hm/slam/laser/search/correlative_search.hpp"

namespace hm {

struct GridLocaliserParams {
  double sigma_m = 0.1;
  /// Maximum range of the points used.
  static constexpr double kMaxPointRange_m = 15;
  /// Maximum number of points used per scan.
  static constexpr int kMaxPoints = 180;
  /// Minimum number of points of a scan (kTooFewPoints).
  static constexpr int kMinPoints = 30;
  double global_min_score = 0.55, ambiguity_ratio = 0.92;
  /// Minimum distance between two candidates that count as different places.
  double other_place_m = 1.0;
  /// Half width of the tracking window.
  static constexpr double kWindow_m = 0.3;
  /// Half width of the tracking window.
  static constexpr double kWindow_rad = 0.2;
  /// Minimum mean likelihood for tracking.
  static constexpr double kTrackMinScore = 0.4;
  /// After so many scans without a match the place is lost.
  int max_failures = 5;
  /// Bound on the cost of one global search.
  int global_max_evaluations = 20'000'000;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"sigma_m", {0.005, 1}, "spread of the likelihood about an occupied cell"}, self.sigma_m);
    v(ParamDoc{"global_min_score", {0, 1}, "mean likelihood that finding the place needs"},
      self.global_min_score);
    v(ParamDoc{"ambiguity_ratio", {0, 1}, "no answer when another place scores more than this part of it"},
      self.ambiguity_ratio);
  }
};

enum class LocalisationStatus {
  kLocalised,     ///< found by a search in the whole map
  kTracking,      ///< tracked from the previous scan
  kMatchFailed,   ///< tracking failed for this scan; the predicted pose is kept
  kLost,          ///< tracking failed `max_failures` times; the next scan is searched in the whole map
  kNotFound,      ///< no match in the whole map
  kAmbiguous,     ///< several matches in the whole map; a scan from another position may resolve it
  kLimitReached,  ///< the search exceeded `global_max_evaluations`
  kTooFewPoints,  ///< the scan has fewer than kMinPoints points in range
  kEmptyMap,      ///< the map has no occupied cell
};
std::string_view to_string(LocalisationStatus status);

struct Localisation {
  LocalisationStatus status = LocalisationStatus::kNotFound;
  std::optional<SE2> T_map_base;  ///< set for kLocalised and kTracking
  double score = 0;               ///< mean likelihood of the points, 0 to 1
};

/// Localises a vehicle in a saved map: first by branch and bound in the whole map, then by tracking from scan
/// to scan. Does not change the map. Deterministic; not thread safe.
class GridLocaliser {
 public:
  /// Uses cells with an occupancy of at least 50 % as obstacles and ignores all others.
  explicit GridLocaliser(const OccupancyGrid2D& grid, const GridLocaliserParams& params = {});

  /// Processes a scan. `T_last_now`: motion of the base since the previous scan, from odometry.
  Localisation process(const PlanarScan& scan, const SE2& T_last_now = {});
  /// Starts tracking from a known pose.
  void start(const SE2& T_map_base);
  /// Resets to unlocalised: the next scan is searched in the whole map.
  void reset();

 private:
  Localisation seek(std::span<const Vec2> points_m);
  Localisation follow(std::span<const Vec2> points_m, const SE2& T_map_predicted);
  Localisation lose();

  GridLocaliserParams params_;
  CorrelativeMap map_;
  std::optional<SE2> T_map_base_;
  int failures_ = 0;
};

}  // namespace hm
