#include "hm/pipeline/laser/run/laser_scan_counts.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

constexpr double kTruthMaxGap_s = 0.1;

void count(LocalisationStatus status, LocalisationSummary& summary) {
  ++summary.scans;
  switch (status) {
    case LocalisationStatus::kLocalised:
      ++summary.searches, ++summary.found, ++summary.located;
      return;
    case LocalisationStatus::kTracking:
      ++summary.located;
      return;
    case LocalisationStatus::kMatchFailed:
      ++summary.match_failed;
      return;
    case LocalisationStatus::kLost:
      ++summary.lost;
      return;
    case LocalisationStatus::kAmbiguous:
      ++summary.searches, ++summary.ambiguous;
      return;
    case LocalisationStatus::kLimitReached:
      ++summary.searches, ++summary.limit_reached;
      return;
    case LocalisationStatus::kTooFewPoints:
      ++summary.too_few_points;
      return;
    case LocalisationStatus::kNotFound:
    case LocalisationStatus::kEmptyMap:
      ++summary.searches, ++summary.not_found;
  }
}

}  // namespace

void LaserScanCounts::add(const LaserScanRecord& record) {
  map_frame_ms_.add(record.step.map_frame.ms);
  if (record.step.map_frame.localisation) add_place(record);
  if (record.step.height) add_height(*record.step.height);
}

void LaserScanCounts::add_place(const LaserScanRecord& record) {
  const Localisation& place = *record.step.map_frame.localisation;
  count(place.status, localisation_);
  if (!place.T_map_base) return;
  score_.add(place.score);
  const SE2& T_map_odom = record.step.map_frame.T_map_odom;
  if (!localisation_.first_fix_s) localisation_.first_fix_s = record.time_s;
  if (T_map_odom_last_)
    correction_m_.add((place.T_map_base->translation() -
                       *T_map_odom_last_ * (T_map_odom.inverse() * place.T_map_base->translation()))
                          .norm());
  T_map_odom_last_ = T_map_odom;
}

void LaserScanCounts::add_height(const HeightEstimate& height) {
  if (height.status != HeightStatus::kOk) return;
  const auto T_world_base = pose_at(truth_, height.stamp, Duration::from_seconds(kTruthMaxGap_s));
  if (T_world_base) height_differences_m_.push_back(T_world_base->translation().z() - height.height_m);
}

LocalisationSummary LaserScanCounts::localisation() const {
  LocalisationSummary summary = localisation_;
  summary.score = score_.summary();
  summary.correction_m = correction_m_.summary();
  return summary;
}

std::optional<HeightError> LaserScanCounts::height_error() const {
  if (height_differences_m_.size() < 3) return std::nullopt;
  std::vector<double> differences_m = height_differences_m_;
  HeightError error;
  error.pairs = differences_m.size();
  error.offset_m = quantile(differences_m, 0.5);
  for (double& difference_m : differences_m) difference_m = std::abs(difference_m - error.offset_m);
  const Summary sizes = summarise(differences_m);
  error.rmse_m = sizes.rmse, error.max_m = sizes.max;
  return error;
}

}  // namespace hm
