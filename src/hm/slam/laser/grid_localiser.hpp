#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <string_view>

#include "hm/core/params.hpp"
#include "hm/geometry/occupancy_grid_2d.hpp"
#include "hm/laser/matching/planar_scan.hpp"
#include "hm/slam/laser/correlative_search.hpp"

namespace hm {

struct GridLocaliserParams {
  double sigma_m = 0.1;
  /// Points further away are not used.
  static constexpr double kMaxPointRange_m = 15;
  /// Points of a scan that are used.
  static constexpr int kMaxPoints = 180;
  /// Scans with fewer points say nothing.
  static constexpr int kMinPoints = 30;
  double global_min_score = 0.55, ambiguity_ratio = 0.92;
  /// Minimum distance between two candidates that count as different places.
  double other_place_m = 1.0;
  double window_m = 0.3;
  /// Half the window of tracking.
  static constexpr double kWindow_rad = 0.2;
  /// Mean likelihood that tracking needs.
  static constexpr double kTrackMinScore = 0.4;
  int max_failures = 5;
  int global_max_evaluations = 20'000'000;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"sigma_m", {0.005, 1}, "spread of the likelihood about an occupied cell"}, self.sigma_m);
    v(ParamDoc{"global_min_score", {0, 1}, "mean likelihood that finding the place needs"},
      self.global_min_score);
    v(ParamDoc{"ambiguity_ratio", {0, 1}, "no answer when another place scores more than this part of it"},
      self.ambiguity_ratio);
    v(ParamDoc{"window_m", {0.01, 10}, "half the window of tracking"}, self.window_m);
    v(ParamDoc{"max_failures", {1, 1000}, "after so many scans without a match the place is lost"},
      self.max_failures);
    v(ParamDoc{"global_max_evaluations", {1000, 2000000000}, "bound on the cost of one global search"},
      self.global_max_evaluations);
  }
};

enum class LocalisationStatus {
  kLocalised,     ///< found in the whole map with this scan
  kTracking,      ///< followed from the scan before
  kMatchFailed,   ///< not followed this time: the prediction holds
  kLost,          ///< failed too often: the next scan is sought in the whole map
  kNotFound,      ///< sought in the whole map, and nowhere
  kAmbiguous,     ///< sought in the whole map: it fits several places; a scan from elsewhere may tell
  kGaveUp,        ///< the map is too large for the bound on the search
  kTooFewPoints,  ///< the scan says nothing
  kEmptyMap,      ///< the map has no occupied cell
};
std::string_view to_string(LocalisationStatus status);

struct Localisation {
  LocalisationStatus status = LocalisationStatus::kNotFound;
  std::optional<SE2> T_map_base;  ///< with kLocalised and kTracking
  double score = 0;               ///< mean likelihood of the points, 0 to 1
};

/// The place in a saved map: sought in all of it by branch and bound, then followed scan by scan. The map is
/// not changed. Deterministic; not thread safe.
class GridLocaliser {
 public:
  /// Occupied cells (50 % and more) are walls; the rest says nothing.
  explicit GridLocaliser(const OccupancyGrid2D& grid, const GridLocaliserParams& params = {});

  /// Seeks or follows. `T_last_now` is the motion of the base since the scan before, from odometry.
  Localisation process(const PlanarScan& scan, const SE2& T_last_now = {});
  /// Begins to follow from a pose known from elsewhere.
  void start(const SE2& T_map_base);
  /// Forgets the place: the next scan is sought in the whole map.
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
