#include "hm/laser/height/floor_filter.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/check.hpp"

namespace hm {

void FloorFilter::start(Time time, double distance_m, double variance_m2) {
  mean_.setZero();
  covariance_.setZero();
  mean_(0) = distance_m;
  covariance_(0, 0) = variance_m2;
  covariance_(1, 1) = params_.kInitialClimbStd_m_s * params_.kInitialClimbStd_m_s;
  covariance_(2, 2) = params_.kInitialBiasStd_m_s2 * params_.kInitialBiasStd_m_s2;
  records_[0] = {.id = 0, .sightings = 1, .confirmed = true, .first_seen = time, .last_seen = time};
  floors_ = 1;
  next_id_ = 1;
}

void FloorFilter::predict(double dt_s, const std::optional<double>& acceleration_m_s2) {
  climb_is_measured_ = acceleration_m_s2.has_value();
  const double known_m_s2 = acceleration_m_s2 ? *acceleration_m_s2 - mean_(2) : 0;
  mean_(0) += dt_s * mean_(1) + 0.5 * dt_s * dt_s * known_m_s2;
  mean_(1) += dt_s * known_m_s2;
  // P = A P A^T with A = [1 dt -dt^2/2; 0 1 -dt; 0 0 1] on the first three states: add rows, then columns.
  // What is not measured has no bias.
  const int n = states();
  const double of_bias_s = acceleration_m_s2 ? -dt_s : 0;
  covariance_.row(0).head(n) +=
      dt_s * (covariance_.row(1).head(n) + 0.5 * of_bias_s * covariance_.row(2).head(n));
  covariance_.row(1).head(n) += of_bias_s * covariance_.row(2).head(n);
  covariance_.col(0).head(n) +=
      dt_s * (covariance_.col(1).head(n) + 0.5 * of_bias_s * covariance_.col(2).head(n));
  covariance_.col(1).head(n) += of_bias_s * covariance_.col(2).head(n);
  const double root =
      climb_is_measured_ ? params_.kMeasuredDensity_m_s2_sqrt_hz : params_.acceleration_density_m_s2_sqrt_hz;
  covariance_(0, 0) += root * root * dt_s * dt_s * dt_s / 3;
  covariance_(0, 1) += root * root * dt_s * dt_s / 2;
  covariance_(1, 0) += root * root * dt_s * dt_s / 2;
  covariance_(1, 1) += root * root * dt_s;
  covariance_(2, 2) += params_.kBiasDensity_m_s2_sqrt_s * params_.kBiasDensity_m_s2_sqrt_s * dt_s;
  for (int i = 0; i < floors_; ++i) ++records_[static_cast<std::size_t>(i)].unseen_scans;
}

FloorFilter::Innovation FloorFilter::innovation(int floor, double distance_m, double variance_m2) const {
  HM_CHECK(floor >= 0 && floor < floors_, "floor {} of {}", floor, floors_);
  if (floor == 0) return {distance_m - mean_(0), covariance_(0, 0) + variance_m2};
  const int state = state_of(floor);
  return {distance_m - (mean_(0) - mean_(state)),
          covariance_(0, 0) - 2 * covariance_(0, state) + covariance_(state, state) + variance_m2};
}

void FloorFilter::correct(int floor, Time time, double distance_m, double variance_m2) {
  Innovation seen = innovation(floor, distance_m, variance_m2);
  if (climb_is_measured_) {
    const double most = params_.kMostDeviationsRatio;
    seen.variance_m2 = std::max(seen.variance_m2, seen.residual_m * seen.residual_m / (most * most));
  }
  const int n = states();
  Mean covariance_h = covariance_.col(0);  // P H^T
  if (floor > 0) covariance_h -= covariance_.col(state_of(floor));
  mean_.head(n) += (seen.residual_m / seen.variance_m2) * covariance_h.head(n);
  covariance_.topLeftCorner(n, n) -=
      (covariance_h.head(n) / seen.variance_m2) * covariance_h.head(n).transpose();
  FloorLevel& record = records_[static_cast<std::size_t>(floor)];
  ++record.sightings;
  record.unseen_scans = 0;
  record.confirmed = record.confirmed || record.sightings >= params_.confirm_sightings;
  record.last_seen = time;
}

int FloorFilter::add(Time time, double distance_m, double variance_m2, int keep) {
  if (floors_ == kMaxFloors) {
    int least = keep == 1 ? 2 : 1;
    for (int i = least + 1; i < floors_; ++i)
      if (i != keep && records_[static_cast<std::size_t>(i)].sightings <
                           records_[static_cast<std::size_t>(least)].sightings)
        least = i;
    remove(least);
  }
  const int floor = floors_++, state = state_of(floor);
  mean_(state) = mean_(0) - distance_m;
  covariance_.row(state).head(state) = covariance_.row(0).head(state);
  covariance_.col(state).head(state) = covariance_.col(0).head(state);
  covariance_(state, state) = covariance_(0, 0) + variance_m2;
  records_[static_cast<std::size_t>(floor)] = {.id = next_id_++,
                                               .sightings = 1,
                                               .confirmed = params_.confirm_sightings <= 1,
                                               .first_seen = time,
                                               .last_seen = time};
  return floor;
}

void FloorFilter::remove(int floor) {
  HM_CHECK(floor > 0 && floor < floors_, "floor {} of {}", floor, floors_);
  const int n = states();
  for (int state = state_of(floor); state + 1 < n; ++state) {
    mean_(state) = mean_(state + 1);
    covariance_.row(state).head(n) = covariance_.row(state + 1).head(n).eval();
  }
  for (int state = state_of(floor); state + 1 < n; ++state)
    covariance_.col(state).head(n - 1) = covariance_.col(state + 1).head(n - 1).eval();
  covariance_.row(n - 1).setZero();
  covariance_.col(n - 1).setZero();
  for (int i = floor; i + 1 < floors_; ++i)
    records_[static_cast<std::size_t>(i)] = records_[static_cast<std::size_t>(i + 1)];
  --floors_;
}

double FloorFilter::height_std_m() const { return std::sqrt(std::max(covariance_(0, 0), 0.0)); }
double FloorFilter::climb_std_m_s() const { return std::sqrt(std::max(covariance_(1, 1), 0.0)); }

FloorLevel FloorFilter::floor(int index) const {
  HM_CHECK(index >= 0 && index < floors_, "floor {} of {}", index, floors_);
  FloorLevel level = records_[static_cast<std::size_t>(index)];
  if (index == 0) return level;
  level.level_m = mean_(state_of(index));
  level.std_m = std::sqrt(std::max(covariance_(state_of(index), state_of(index)), 0.0));
  return level;
}

std::optional<int> FloorFilter::index_of(int id) const {
  for (int i = 0; i < floors_; ++i)
    if (records_[static_cast<std::size_t>(i)].id == id) return i;
  return std::nullopt;
}

}  // namespace hm
