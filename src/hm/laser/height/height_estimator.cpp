#include "hm/laser/height/height_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hm {
namespace {

/// Penalties in units of chi2 for associating another floor than the current one, since changes are rare, and
/// for an unconfirmed floor.
constexpr double kOtherFloorChi2 = 6, kUnconfirmedFloorChi2 = 10;
/// At an edge, the current floor is kept until the other one has this many times its readings.
constexpr int kSwitchFactor = 2;
/// Additional error of a mode from readings at an edge: a share of the variance that they add, and a share of
/// the half width for readings that belong to no surface.
constexpr double kEdgePull = 0.25, kUnexplainedPull = 0.75;

bool all_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

}  // namespace

HeightEstimator::HeightEstimator(const HeightParams& params, SurfaceSide side)
    : params_(params), side_(side), filter_(params) {}

HeightEstimate HeightEstimator::update(const MirrorDistances& scan,
                                       const std::optional<double>& acceleration_m_s2) {
  HeightEstimate ignored = last_;
  ignored.event = FloorEvent::kNone;
  ignored.step_m = 0;
  if (!std::isfinite(scan.tilt_rad) || !std::isfinite(acceleration_m_s2.value_or(0)) ||
      !all_finite(scan.distances_m)) {
    ignored.status = HeightStatus::kInvalidInput;
    return ignored;
  }
  if (any_scan_ && scan.stamp <= last_.stamp) {
    ignored.status = HeightStatus::kTimeBackwards;
    return ignored;
  }
  if (filter_.started()) {
    std::optional<double> up_m_s2 = acceleration_m_s2;
    if (up_m_s2 && side_ == SurfaceSide::kCeiling) up_m_s2 = -*up_m_s2;
    filter_.predict((scan.stamp - last_.stamp).seconds(), up_m_s2);
  }
  any_scan_ = true;
  last_.stamp = scan.stamp;
  if (scan.tilt_rad > params_.max_tilt_rad) return finish(HeightStatus::kTilted, {});
  if (scan.distances_m.size() < static_cast<std::size_t>(params_.min_readings))
    return finish(HeightStatus::kTooFewReadings, {});
  sorted_m_ = scan.distances_m;
  const HeightModes modes = find_height_modes(sorted_m_, params_);
  explained_ratio_ = modes.explained_ratio;
  // At an edge, modes with few readings are often between the floors; these scans give no result.
  const bool doubtful = modes.explained_ratio < params_.min_explained_ratio;
  const bool can_wait = filter_.started() && filter_.height_std_m() < params_.kDoubtfulHeightStd_m;
  if (modes.size == 0 || (doubtful && can_wait)) return finish(HeightStatus::kSpreadTooWide, {});
  return finish(HeightStatus::kOk, modes);
}

HeightEstimate HeightEstimator::finish(HeightStatus status, const HeightModes& modes) {
  HeightEstimate estimate;
  estimate.stamp = last_.stamp;
  estimate.status = status;
  if (status == HeightStatus::kOk) {
    if (filter_.started()) {
      forget_unconfirmed();
      follow_floor(associate(estimate.stamp, modes), estimate);
    } else {
      filter_.start(estimate.stamp, modes.modes[0].distance_m, variance_m2(modes.modes[0]));
    }
    estimate.clearance_m = modes.modes[0].distance_m;
    estimate.spread_m = modes.modes[0].spread_m;
    estimate.readings = modes.modes[0].readings;
  }
  if (filter_.started()) {
    estimate.height_m = filter_.height_m();
    estimate.height_std_m = filter_.height_std_m();
    estimate.climb_m_s = filter_.climb_m_s();
    estimate.climb_std_m_s = filter_.climb_std_m_s();
    estimate.floor_level_m = filter_.floor(filter_.index_of(current_id_).value_or(0)).level_m;
    estimate.floor_id = current_id_;
  }
  last_ = estimate;
  return estimate;
}

double HeightEstimator::variance_m2(const HeightMode& mode) const {
  const auto square = [](double value) { return value * value; };
  // The spread of a single reading is undefined.
  const double least_m = mode.readings > 1 ? 0.5 * params_.reading_std_m : params_.reading_std_m;
  const double noise_m2 = square(std::max(mode.spread_m, least_m)) / mode.readings;
  const double excess_m2 = std::max(square(mode.spread_m) - square(params_.reading_std_m), 0.0);
  const double unexplained_m = kUnexplainedPull * (1 - explained_ratio_) * params_.mode_half_width_m();
  return noise_m2 + square(params_.kLevelStd_m) + kEdgePull * excess_m2 + square(unexplained_m);
}

/// The same of a sighting of a floor. Where an IMU tells the climb, one that is not confirmed counts little:
/// it may be part of a ramp, which would pull the height a little with each scan.
double HeightEstimator::variance_m2(const HeightMode& mode, const FloorLevel& floor) const {
  const double ramp_m = filter_.climb_is_measured() && !floor.confirmed ? params_.kRampStd_m : 0;
  return variance_m2(mode) + ramp_m * ramp_m;
}

int HeightEstimator::best_floor(const HeightMode& mode, const Sightings& taken) const {
  int best = -1;
  double best_chi2 = std::numeric_limits<double>::infinity();
  for (int i = 0; i < filter_.floors(); ++i) {
    const FloorLevel floor = filter_.floor(i);
    if (std::any_of(taken.begin(), taken.end(),
                    [&](const Sighting& other) { return other.floor_id == floor.id; }))
      continue;
    const auto seen = filter_.innovation(i, mode.distance_m, variance_m2(mode, floor));
    const double sigma_m = std::sqrt(seen.variance_m2);
    if (std::abs(seen.residual_m) > std::max(params_.min_step_m, params_.kStepSigmasRatio * sigma_m))
      continue;
    double chi2 = seen.residual_m * seen.residual_m / seen.variance_m2;
    if (floor.id != current_id_) chi2 += floor.confirmed ? kOtherFloorChi2 : kUnconfirmedFloorChi2;
    if (chi2 < best_chi2) best_chi2 = chi2, best = i;
  }
  return best;
}

/// Surfaces that match a floor correct the height first, so that new floors start from the best height
/// estimate.
HeightEstimator::Sightings HeightEstimator::associate(Time time, const HeightModes& modes) {
  Sightings seen{};
  for (const bool add_new : {false, true}) {
    for (int i = 0; i < modes.size; ++i) {
      Sighting& sighting = seen[static_cast<std::size_t>(i)];
      if (sighting.floor_id >= 0) continue;
      const HeightMode& mode = modes.modes[static_cast<std::size_t>(i)];
      int floor = best_floor(mode, seen);
      if (floor >= 0) {
        filter_.correct(floor, time, mode.distance_m, variance_m2(mode, filter_.floor(floor)));
      } else if (add_new) {
        floor =
            filter_.add(time, mode.distance_m, variance_m2(mode), filter_.index_of(current_id_).value_or(0));
      } else {
        continue;
      }
      sighting = {filter_.floor(floor).id, mode.readings};
    }
  }
  return seen;
}

void HeightEstimator::forget_unconfirmed() {
  for (int i = filter_.floors() - 1; i > 0; --i) {
    const FloorLevel floor = filter_.floor(i);
    if (!floor.confirmed && floor.unseen_scans > params_.kForgetUnseenScans) filter_.remove(i);
  }
}

void HeightEstimator::follow_floor(const Sightings& seen, HeightEstimate& estimate) {
  int over_id = -1, over_readings = 0, current_readings = 0;
  for (const Sighting& sighting : seen) {
    const auto floor = sighting.floor_id >= 0 ? filter_.index_of(sighting.floor_id) : std::nullopt;
    if (!floor || !filter_.floor(*floor).confirmed) continue;
    if (sighting.floor_id == current_id_) current_readings = sighting.readings;
    if (sighting.readings > over_readings) over_readings = sighting.readings, over_id = sighting.floor_id;
  }
  if (over_id < 0 || over_id == current_id_ || over_readings < kSwitchFactor * current_readings) return;
  const FloorLevel from = filter_.floor(filter_.index_of(current_id_).value_or(0));
  const FloorLevel to = filter_.floor(filter_.index_of(over_id).value_or(0));
  current_id_ = over_id;
  estimate.step_m = to.level_m - from.level_m;
  estimate.event = estimate.step_m > 0 ? FloorEvent::kStepUp : FloorEvent::kStepDown;
}

std::vector<FloorLevel> HeightEstimator::profile() const {
  std::vector<FloorLevel> floors;
  for (int i = 0; i < filter_.floors(); ++i)
    if (filter_.floor(i).confirmed) floors.push_back(filter_.floor(i));
  std::stable_sort(floors.begin(), floors.end(),
                   [](const FloorLevel& a, const FloorLevel& b) { return a.level_m < b.level_m; });
  return floors;
}

}  // namespace hm
