#pragma once
#include <cstddef>
#include <span>
#include <string_view>

#include "hm/slam/laser/correlative_map.hpp"
#include "hm/slam/laser/observed_area.hpp"

namespace hm {

/// Where to search: half the width of the window about `centre` in x and y, and of its angles.
struct SearchWindow {
  SE2 centre;  ///< T_map_scan
  double half_x_m = 1, half_y_m = 1, half_angle_rad = 0.5;
};

struct CorrelativeSearchParams {
  double min_score = 0.55;
  double angle_step_rad = 0;  ///< 0: such that no point moves by more than a cell
  /// Another place, this far off, that scores more than `ambiguity_ratio` of the best makes it ambiguous.
  double other_place_m = 0.4, other_angle_rad = 0.3, ambiguity_ratio = 0.92;
  /// Other places are sought in a window so many times as wide: where a structure repeats, the right place
  /// may be one that the map does not show, and a wrong one is given away by the next wrong one beyond the
  /// window.
  double other_window_ratio = 1;
  /// Where the map was looked at; none: everywhere. Other places are judged by the points they have inside,
  /// if these are `min_overlap_ratio` of all: at the rim of a map the right place may see less of it than a
  /// wrong one.
  const ObservedArea* seen = nullptr;
  double min_overlap_ratio = 0.5;
  /// Score penalty for the squared offset of a candidate from the centre of the window.
  double shift_penalty_per_m2 = 0, turn_penalty_per_rad2 = 0;
  std::size_t max_evaluations = 2'000'000;  ///< of candidates; then the search gives up
};

enum class CorrelativeStatus {
  kFound,
  kNothing,    ///< no pose of the window reaches min_score
  kAmbiguous,  ///< another place of the window fits nearly as well
  kGaveUp,     ///< the window was too large for max_evaluations
};
std::string_view to_string(CorrelativeStatus status);

struct CorrelativeMatch {
  CorrelativeStatus status = CorrelativeStatus::kNothing;
  SE2 T_map_scan;          ///< the best pose, refined below a cell; meaningful with kFound and kAmbiguous
  double score = 0;        ///< mean likelihood there, 0 to 1, on the raster, penalties taken off
  double other_score = 0;  ///< kAmbiguous: of one such other place
  std::size_t evaluations = 0;
};

/// The pose of a scan that fits a map best in all of a window, to the cell and angle step: branch and bound
/// over the pyramid (Hess et al., ICRA 2016, algorithm 3), then a second search for other places that fit as
/// well, then refinement. Deterministic; thread safe.
CorrelativeMatch search_correlative(const CorrelativeMap& map, std::span<const Vec2> points_m,
                                    const SearchWindow& window, const CorrelativeSearchParams& params = {});

/// Climbs from a pose to the next maximum of CorrelativeMap::score, at most about a cell away (pattern
/// search).
SE2 refine_on_map(const CorrelativeMap& map, std::span<const Vec2> points_m, const SE2& T_map_scan);

}  // namespace hm
