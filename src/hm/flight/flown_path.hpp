#pragma once
#include <array>
#include <cstddef>

#include "hm/core/param_doc.hpp"
#include "hm/geometry/float/float_math.hpp"

namespace hm {

struct FlownPathParams {
  float path_spacing_m = 0.5F;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"path_spacing_m", {0.1, 10}, "distance between the recorded points of the way home"},
      self.path_spacing_m);
  }
};

/// The way back: way points where the vehicle has flown, from home to its last position, of bounded number.
///
/// A point is recorded each path_spacing_m. Where the path comes back to within half of it of an earlier
/// point, the loop between is cut off. When the record is full, the point is removed that changes the path
/// least. Recording and removing cost O(capacity).
class FlownPath {
 public:
  static constexpr std::size_t kCapacity = 64;

  explicit FlownPath(const FlownPathParams& params = {}) : spacing_m_(params.path_spacing_m) {}
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
  float spacing_m_;
  std::array<Vec3f, kCapacity> points_{};
  std::size_t size_ = 0;
};

}  // namespace hm
