#include "hm/odometry/interface/inertial_hints.hpp"

#include <algorithm>
#include <span>

namespace hm {
namespace {

constexpr double kMaxHintGap_s = 0.1;  // between readings, and to both ends
/// Before and after the interval, for the delay of the readings' stamps.
constexpr double kHintMargin_s = 0.15;

/// Samples from the last one before `begin` to the first one after `end`.
std::span<const ImuSample> readings_over(const std::vector<ImuSample>& samples, Time begin, Time end) {
  const auto before = [](const ImuSample& sample, Time stamp) { return sample.stamp < stamp; };
  auto first = std::lower_bound(samples.begin(), samples.end(), begin, before);
  auto last = std::lower_bound(first, samples.end(), end, before);
  if (first != samples.begin() && first != samples.end() && first->stamp > begin) --first;
  if (last != samples.end()) ++last;
  return {first, last};
}

bool spans(std::span<const ImuSample> readings, Time begin, Time end) {
  if (readings.empty()) return false;
  const auto too_far = [](Time a, Time b) { return (b - a).seconds() > kMaxHintGap_s; };
  if (too_far(begin, readings.front().stamp) || too_far(readings.back().stamp, end)) return false;
  return std::adjacent_find(readings.begin(), readings.end(), [&](const ImuSample& a, const ImuSample& b) {
           return too_far(a.stamp, b.stamp);
         }) == readings.end();
}

/// Integrals over time: each sample is valid from halfway to the previous one to halfway to the next.
struct ReadingSums {
  Mat3 R_begin_end = Mat3::Identity();
  Vec3 force = Vec3::Zero();
  double duration_s = 0;
};

ReadingSums integrate(std::span<const ImuSample> readings, Time begin, Time end) {
  ReadingSums sums;
  Time from = begin;
  for (std::size_t i = 0; i < readings.size() && from < end; ++i) {
    Time to = end;
    if (i + 1 < readings.size())
      to = std::clamp(readings[i].stamp + Duration{(readings[i + 1].stamp - readings[i].stamp).ns / 2}, from,
                      end);
    const double duration_s = (to - from).seconds();
    sums.R_begin_end *= so3_exp(readings[i].angular_velocity_rad_s * duration_s);
    sums.force += readings[i].specific_force_m_s2 * duration_s;
    sums.duration_s += duration_s;
    from = to;
  }
  return sums;
}

}  // namespace

InertialHints::InertialHints(std::shared_ptr<const CarriedImu> imu, ImuUse use)
    : imu_(std::move(imu)), use_(use) {
  const bool whole = imu_ && imu_->has_gyroscope;
  if (use == ImuUse::kAuto) use_ = whole ? ImuUse::kInertial : ImuUse::kOff;
  if (use == ImuUse::kInertial && !whole) use_ = ImuUse::kGravity;
}

MotionHint InertialHints::next(Time stamp) {
  MotionHint hint;
  const std::optional<Time> last = std::exchange(last_, stamp);
  if (!imu_ || use_ == ImuUse::kOff) return hint;
  if (use_ == ImuUse::kInertial) {
    const Duration margin = Duration::from_seconds(kHintMargin_s);
    hint.readings = readings_over(imu_->samples, last.value_or(stamp) - margin, stamp + margin);
    return hint;
  }
  if (!last || !(stamp > *last)) return hint;
  const auto readings = readings_over(imu_->samples, *last, stamp);
  if (!spans(readings, *last, stamp)) return hint;
  const ReadingSums sums = integrate(readings, *last, stamp);
  if (use_ != ImuUse::kGravity && imu_->has_gyroscope) hint.R_last_current = sums.R_begin_end;
  if (use_ != ImuUse::kGyroscope) hint.force_camera_m_s2 = sums.force / sums.duration_s;
  return hint;
}

}  // namespace hm
