#pragma once
#include <array>
#include <cstddef>

#include "hm/geometry/float/float_math.hpp"

namespace hm {

/// The way back: way points where the vehicle has flown, from home to its last position, of bounded number.
///
/// A point is recorded each kSpacing_m. Where the path comes back to within half of it of an earlier
/// point, the loop between is cut off. When the record is full, the point is removed that changes the path
/// least. Recording and removing cost O(capacity).
class FlownPath {
 public:
  static constexpr std::size_t kCapacity = 64;
  /// Narrower than a door, so that no corner is cut that something stands in; the record holds 32 m of it.
  static constexpr float kSpacing_m = 0.5F;

  /// Forgets everything and starts at home.
  void start(const Vec3f& home_m);
  /// Adds the vehicle's position (finite, odom frame), in order of time.
  void record(const Vec3f& position_m);
  [[nodiscard]] std::size_t size() const { return size_; }
  /// 0 is home.
  [[nodiscard]] const Vec3f& point(std::size_t index) const { return points_[index]; }
  /// The last point, home if there is no other; and removes it if it is not home. For the flight home.
  void drop_last() { size_ -= size_ > 1 ? 1U : 0U; }
  [[nodiscard]] const Vec3f& last() const { return points_[size_ > 0 ? size_ - 1 : 0]; }
  /// Length of the way home from a position.
  [[nodiscard]] float length_m(const Vec3f& from_m) const;

 private:
  void remove_least_needed();
  std::array<Vec3f, kCapacity> points_{};
  std::size_t size_ = 0;
};

}  // namespace hm
