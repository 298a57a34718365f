#include "hm/odometry/inertial/inertial_tracking.hpp"

#include <algorithm>
#include <vector>

#include "hm/core/statistics.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

constexpr std::size_t kComparisons = 30, kFewest = 10;
constexpr double kWatch_s = 2;  // and these comparisons, at least
// Median over the comparisons; of chi-squared with six degrees of freedom it is 5.3.
constexpr double kConsistent = 25;
constexpr double kNotWorse = 1.0, kNotWorse_m = 0.001;  // than constant velocity
// The same once they are used: where the motion is steady, constant velocity may be as good.
constexpr double kStillNotWorse = 2.0, kStillNotWorse_m = 0.005;
constexpr double kLeastInformation = 100;  // of a visual pose: 10 cm, 0.1 rad

double distance_m(const SE3& a, const SE3& b) {
  const SE3 difference = a.inverse() * b;
  return difference.translation().norm() + difference.angle();
}

template <class Number>
double median_of(const std::deque<Number>& items, double Number::*member) {
  std::vector<double> values;
  for (const Number& item : items) values.push_back(item.*member);
  return middle_value(std::span(values));
}

}  // namespace

void InertialTracking::feed(std::span<const ImuSample> readings) {
  if (!readings.empty() && use_ == InertialUse::kNone) use_ = InertialUse::kLearning;
  window_.feed(readings);
}

std::optional<InertialPrediction> InertialTracking::predict(Time stamp) const {
  return use_ == InertialUse::kUsed ? window_.predict(stamp) : std::nullopt;
}

std::optional<GyroTurn> InertialTracking::turn(Time begin, Time end) const {
  return use_ == InertialUse::kUsed ? window_.turn(begin, end) : std::nullopt;
}

void InertialTracking::add(Time stamp, const VisualPose& vision, const SE3& T_by_velocity) {
  if (const auto prediction = window_.predict(stamp)) compare(*prediction, vision, T_by_velocity);
  window_.add(stamp, vision);
  if (use_ != InertialUse::kNone) use_ = judged();
}

void InertialTracking::begin(Time stamp, const VisualPose& vision) {
  if (use_ == InertialUse::kNone) return;
  use_ = InertialUse::kLearning;
  comparisons_.clear();
  window_.forget();
  window_.continue_from(stamp, vision, nullptr);
}

void InertialTracking::continue_from(Time stamp, const VisualPose& vision,
                                     const InertialPrediction* prediction) {
  window_.continue_from(stamp, vision, prediction);
}

void InertialTracking::compare(const InertialPrediction& prediction, const VisualPose& vision,
                               const SE3& T_by_velocity) {
  Mat6 information = vision.information;
  information.diagonal().array() += kLeastInformation;
  const SE3 T_seen = vision.T_odom_camera * SE3::exp(-solve_symmetric(information, vision.gradient));
  const Vec6 miss = (prediction.state.T_odom_camera.inverse() * T_seen).log();
  const Mat6 covariance = prediction.pose_covariance() + inverse_of(information);
  comparisons_.push_back({prediction.stamp, miss.dot(solve_symmetric(covariance, miss)),
                          distance_m(prediction.state.T_odom_camera, T_seen),
                          distance_m(T_by_velocity, T_seen)});
  while (comparisons_.size() > kComparisons &&
         (comparisons_.back().stamp - comparisons_[1].stamp).seconds() >= kWatch_s)
    comparisons_.pop_front();
}

InertialUse InertialTracking::judged() const {
  const bool knows = use_ == InertialUse::kUsed;
  if (!knows && (comparisons_.size() < kFewest ||
                 (comparisons_.back().stamp - comparisons_.front().stamp).seconds() < kWatch_s))
    return use_;
  if (comparisons_.empty()) return use_;
  if (!(median_of(comparisons_, &Comparison::squared_mahalanobis) < kConsistent))
    return InertialUse::kInconsistent;
  const double ours_m = median_of(comparisons_, &Comparison::error_m);
  const double peer_m = median_of(comparisons_, &Comparison::by_velocity_m);
  const double allowed_m =
      knows ? kStillNotWorse * peer_m + kStillNotWorse_m : kNotWorse * peer_m + kNotWorse_m;
  return ours_m < allowed_m ? InertialUse::kUsed : InertialUse::kWorse;
}

std::size_t InertialTracking::memory_bytes() const {
  return sizeof(*this) + window_.memory_bytes() + comparisons_.size() * sizeof(Comparison);
}

}  // namespace hm
