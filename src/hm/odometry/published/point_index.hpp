#pragma once
#include <span>
#include <vector>

#include "hm/geometry/se3.hpp"

namespace hm {

/// A k-d tree over points in space (Bentley 1975; leaves of a few points). It keeps its own copy; indices are
/// those of the points given. Searches are const and give the same answer in any order; of equally near
/// points the one with the lower index.
class PointIndex {
 public:
  PointIndex() = default;
  explicit PointIndex(std::span<const Vec3> points);

  struct Neighbour {
    int index = -1;
    double squared_distance_m2 = 0;
    [[nodiscard]] bool operator<(const Neighbour& other) const {
      return squared_distance_m2 != other.squared_distance_m2
                 ? squared_distance_m2 < other.squared_distance_m2
                 : index < other.index;
    }
  };

  /// The nearest point closer than `max_distance_m`; index -1 if there is none.
  [[nodiscard]] Neighbour nearest(const Vec3& query, double max_distance_m) const;
  /// Up to `count` nearest points into `out`, by distance.
  void nearest(const Vec3& query, int count, std::vector<Neighbour>& out) const;

  [[nodiscard]] std::size_t size() const { return items_.size(); }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Item {
    Vec3 point;
    int index = 0;
  };
  /// Left child at `first`, right child at `first + 1`; a leaf holds items [first, end).
  struct Node {
    int axis = -1;  ///< -1: leaf
    double split = 0;
    int first = 0, end = 0;
  };
  void build(int node, int begin, int end);
  template <class Visit>
  void visit(const Vec3& query, Visit& state) const;

  std::vector<Item> items_;
  std::vector<Node> nodes_;
};

}  // namespace hm
