#pragma once
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "hm/geometry/se3.hpp"

namespace hm {

/// Nearest-neighbour search in 3D with nanoflann's k-d tree, which holds a copy of the points. Results are
/// indices of the given points; of equally near points the lower index is preferred.
class PointIndex {
 public:
  PointIndex();
  explicit PointIndex(std::span<const Vec3> points);
  ~PointIndex();
  PointIndex(PointIndex&&) noexcept;
  PointIndex& operator=(PointIndex&&) noexcept;

  struct Neighbour {
    int index = -1;
    double squared_distance_m2 = 0;
    [[nodiscard]] bool operator<(const Neighbour& other) const {
      return squared_distance_m2 != other.squared_distance_m2
                 ? squared_distance_m2 < other.squared_distance_m2
                 : index < other.index;
    }
  };

  /// Nearest point closer than `max_distance_m`; index -1 if there is none.
  [[nodiscard]] Neighbour nearest(const Vec3& query, double max_distance_m) const;
  /// Writes up to `count` nearest points to `out`, by distance.
  void nearest(const Vec3& query, int count, std::vector<Neighbour>& out) const;

  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;  ///< null without points
};

}  // namespace hm
