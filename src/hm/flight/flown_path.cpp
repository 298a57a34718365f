#include "hm/flight/flown_path.hpp"

#include <limits>

namespace hm {
namespace {

/// Distance of a point from the segment a-b.
float distance_from_segment(const Vec3f& point, const Vec3f& a, const Vec3f& b) {
  const Vec3f along = b - a, to_point = point - a;
  const float square = dot_f(along, along);
  const float share = square > 0 ? clamp_f(dot_f(to_point, along) / square, 0, 1) : 0;
  return norm_f(Vec3f(to_point - share * along));
}

}  // namespace

void FlownPath::start(const Vec3f& home_m) {
  points_[0] = home_m;
  size_ = 1;
}

void FlownPath::record(const Vec3f& position_m) {
  if (size_ == 0) return start(position_m);
  for (std::size_t i = 0; i + 1 < size_; ++i) {
    if (norm_f(Vec3f(position_m - points_[i])) < 0.5F * kSpacing_m) {
      size_ = i + 1;  // back at an earlier point: what lies between is a loop
      return;
    }
  }
  if (norm_f(Vec3f(position_m - last())) < kSpacing_m) return;
  if (size_ == kCapacity) remove_least_needed();
  points_[size_++] = position_m;
}

void FlownPath::remove_least_needed() {
  std::size_t least = 1;
  float least_m = std::numeric_limits<float>::infinity();
  for (std::size_t i = 1; i + 1 < size_; ++i) {
    const float change_m = distance_from_segment(points_[i], points_[i - 1], points_[i + 1]);
    if (change_m < least_m) {
      least_m = change_m;
      least = i;
    }
  }
  for (std::size_t i = least; i + 1 < size_; ++i) points_[i] = points_[i + 1];
  --size_;
}

float FlownPath::length_m(const Vec3f& from_m) const {
  if (size_ == 0) return 0;
  float length = norm_f(Vec3f(from_m - last()));
  for (std::size_t i = 1; i < size_; ++i) length += norm_f(Vec3f(points_[i] - points_[i - 1]));
  return length;
}

}  // namespace hm
