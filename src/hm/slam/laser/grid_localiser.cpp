#include "hm/slam/laser/grid_localiser.hpp"

#include <numbers>

#include "hm/slam/laser/scan_submaps.hpp"

namespace hm {
namespace {

constexpr int kMapLevels = 8;

std::vector<Vec2> occupied_centres(const OccupancyGrid2D& grid) {
  std::vector<Vec2> centres;
  for (int y = 0; y < grid.cells.height(); ++y)
    for (int x = 0; x < grid.cells.width(); ++x)
      if (grid.state(x, y) == Occupancy::kOccupied) centres.push_back(grid.center_of(x, y));
  return centres;
}

}  // namespace

std::string_view to_string(LocalisationStatus status) {
  switch (status) {
    case LocalisationStatus::kLocalised:
      return "localised";
    case LocalisationStatus::kTracking:
      return "tracking";
    case LocalisationStatus::kMatchFailed:
      return "match failed";
    case LocalisationStatus::kLost:
      return "lost";
    case LocalisationStatus::kNotFound:
      return "not found";
    case LocalisationStatus::kAmbiguous:
      return "ambiguous";
    case LocalisationStatus::kLimitReached:
      return "search limit reached";
    case LocalisationStatus::kTooFewPoints:
      return "too few points";
    case LocalisationStatus::kEmptyMap:
      return "empty map";
  }
  return "";
}

GridLocaliser::GridLocaliser(const OccupancyGrid2D& grid, const GridLocaliserParams& params)
    : params_(params), map_(occupied_centres(grid), {grid.resolution_m, params.sigma_m, kMapLevels}) {}

void GridLocaliser::start(const SE2& T_map_base) {
  T_map_base_ = T_map_base;
  failures_ = 0;
}

void GridLocaliser::reset() { T_map_base_.reset(); }

Localisation GridLocaliser::process(const PlanarScan& scan, const SE2& T_last_now) {
  if (map_.empty()) return {LocalisationStatus::kEmptyMap, {}, 0};
  const std::vector<Vec2> points_m =
      points_within(scan, params_.kMaxPointRange_m, static_cast<std::size_t>(params_.kMaxPoints));
  if (T_map_base_) T_map_base_ = *T_map_base_ * T_last_now;
  if (points_m.size() < static_cast<std::size_t>(params_.kMinPoints))
    return {LocalisationStatus::kTooFewPoints, {}, 0};
  return T_map_base_ ? follow(points_m, *T_map_base_) : seek(points_m);
}

Localisation GridLocaliser::seek(std::span<const Vec2> points_m) {
  const Vec2 centre = (map_.low_m() + map_.high_m()) / 2, half = (map_.high_m() - map_.low_m()) / 2;
  CorrelativeSearchParams search;
  search.min_score = params_.global_min_score;
  search.ambiguity_ratio = params_.ambiguity_ratio;
  search.other_place_m = params_.other_place_m;
  search.max_evaluations = static_cast<std::size_t>(params_.global_max_evaluations);
  const CorrelativeMatch match =
      search_correlative(map_, points_m, {SE2(centre, 0), half.x(), half.y(), std::numbers::pi}, search);
  switch (match.status) {
    case CorrelativeStatus::kFound:
      start(match.T_map_scan);
      return {LocalisationStatus::kLocalised, T_map_base_, match.score};
    case CorrelativeStatus::kAmbiguous:
      return {LocalisationStatus::kAmbiguous, {}, match.score};
    case CorrelativeStatus::kLimitReached:
      return {LocalisationStatus::kLimitReached, {}, match.score};
    case CorrelativeStatus::kNothing:
      break;
  }
  return {LocalisationStatus::kNotFound, {}, match.score};
}

Localisation GridLocaliser::follow(std::span<const Vec2> points_m, const SE2& T_map_predicted) {
  // The pose becomes less certain with every failed scan.
  const double widened = 1 + failures_;
  CorrelativeSearchParams search;
  search.min_score = params_.kTrackMinScore;
  search.ambiguity_ratio = 1;
  search.other_place_m = params_.kWindow_m * widened;
  const CorrelativeMatch match =
      search_correlative(map_, points_m,
                         {T_map_predicted, params_.kWindow_m * widened, params_.kWindow_m * widened,
                          params_.kWindow_rad * widened},
                         search);
  if (match.status != CorrelativeStatus::kFound && match.status != CorrelativeStatus::kAmbiguous)
    return lose();
  start(match.T_map_scan);
  return {LocalisationStatus::kTracking, T_map_base_, match.score};
}

Localisation GridLocaliser::lose() {
  if (++failures_ < params_.max_failures) return {LocalisationStatus::kMatchFailed, {}, 0};
  reset();
  failures_ = 0;
  return {LocalisationStatus::kLost, {}, 0};
}

}  // namespace hm
