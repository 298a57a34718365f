#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "hm/slam/laser/search/correlative_map.hpp"

namespace hm {

/// Search window: its centre and half widths in x, y and angle.
struct SearchWindow {
  SE2 centre;  ///< T_map_scan
  double half_x_m = 1, half_y_m = 1, half_angle_rad = 0.5;
};

struct CorrelativeSearchParams {
  double min_score = 0.55;
  double angle_step_rad = 0;  ///< 0: so that no point moves by more than a cell per step
  /// The match is ambiguous if a pose at least this far away scores `ambiguity_ratio` of the best score;
  /// kNoAlternatives: they are not looked for.
  static constexpr double kNoAlternatives = 2;
  double other_place_m = 0.4, other_angle_rad = 0.3, ambiguity_ratio = 0.92;
  /// Size of the search for alternative poses relative to the window, in x, y and (up to 0.3 rad more) angle.
  /// In a repetitive structure whose true match is missing from the map, a wrong match is detected only by
  /// the next repetition, which may lie outside the window; along a curve also by its angle.
  double other_window_ratio = 1;
  /// Alternative poses are scored by their points inside the observed area of the map, if it is known and
  /// these are at least `min_overlap_ratio` of all points: near the map's border, the true pose may overlap
  /// the map less than a wrong one.
  double min_overlap_ratio = 0.5;
  /// Poses that differ along this axis of the map (unit vector) are no alternatives, however far away: in a
  /// corridor, the walls determine all but the place along it.
  std::optional<Vec2> free_axis;
  /// Score penalty for the squared offset of a candidate from the centre of the window.
  double shift_penalty_per_m2 = 0, turn_penalty_per_rad2 = 0;
  std::size_t max_evaluations = 2'000'000;  ///< maximum number of candidates; beyond: kLimitReached
};

enum class CorrelativeStatus {
  kFound,
  kNothing,       ///< no pose of the window reaches min_score
  kAmbiguous,     ///< another pose in the search for alternatives fits nearly as well
  kLimitReached,  ///< the window was too large for max_evaluations
};
std::string_view to_string(CorrelativeStatus status);

struct CorrelativeMatch {
  CorrelativeStatus status = CorrelativeStatus::kNothing;
  SE2 T_map_scan;          ///< best pose with subcell accuracy; valid for kFound and kAmbiguous
  double score = 0;        ///< mean likelihood on the raster, 0 to 1, minus penalties
  double other_score = 0;  ///< kAmbiguous: score of an alternative pose
  std::size_t evaluations = 0;
};

/// Finds the pose of a scan in a window with the best score, exact to one cell and angle step, by branch and
/// bound over the pyramid (Hess et al., ICRA 2016, algorithm 3); searches for alternative poses with a
/// similar score; then refines the pose. Deterministic; thread safe.
CorrelativeMatch search_correlative(const CorrelativeMap& map, std::span<const Vec2> points_m,
                                    const SearchWindow& window, const CorrelativeSearchParams& params = {});

/// Moves a pose to the nearest local maximum of CorrelativeMap::score, about one cell away at most (pattern
/// search).
SE2 refine_on_map(const CorrelativeMap& map, std::span<const Vec2> points_m, const SE2& T_map_scan);

}  // namespace hm
