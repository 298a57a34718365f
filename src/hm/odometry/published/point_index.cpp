#include "hm/odometry/published/point_index.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>

namespace hm {

namespace {

/// Points per leaf: larger leaves are built faster, and the model's index is built for every frame.
constexpr std::size_t kLeafSize = 20;

/// Adapter of the points for nanoflann.
struct PointSet {
  std::vector<Vec3> points;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t index, std::size_t axis) const {
    return points[index].data()[axis];
  }
  template <class Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};

// nanoflann's own result sets return any of equally near points, since the search skips distances equal to
// worstDist(). These return the next larger number from worstDist(), so that equally near points are compared
// too, and prefer the lower index. The names in camel case are required by nanoflann.

double just_above(double squared_distance_m2) {
  return std::nextafter(squared_distance_m2, std::numeric_limits<double>::infinity());
}

/// Nearest point within the limit.
struct NearestOne {
  using DistanceType = double;
  double worst_m2;
  PointIndex::Neighbour best;

  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] double worstDist() const { return worst_m2; }
  bool addPoint(double squared_distance_m2, int index) {
    const PointIndex::Neighbour candidate{index, squared_distance_m2};
    if (best.index < 0 || candidate < best) {
      best = candidate;
      worst_m2 = just_above(squared_distance_m2);
    }
    return true;
  }
};

/// The `count` nearest points, sorted.
struct NearestFew {
  using DistanceType = double;
  std::vector<PointIndex::Neighbour>& sorted;
  std::size_t count;

  [[nodiscard]] bool full() const { return sorted.size() == count; }
  [[nodiscard]] double worstDist() const {
    return full() ? just_above(sorted.back().squared_distance_m2) : std::numeric_limits<double>::infinity();
  }
  bool addPoint(double squared_distance_m2, int index) {
    const PointIndex::Neighbour candidate{index, squared_distance_m2};
    if (full()) {
      if (!(candidate < sorted.back())) return true;
      sorted.pop_back();
    }
    sorted.insert(std::upper_bound(sorted.begin(), sorted.end(), candidate), candidate);
    return true;
  }
};

}  // namespace

struct PointIndex::Tree {
  using Metric = nanoflann::L2_Simple_Adaptor<double, PointSet>;

  explicit Tree(std::span<const Vec3> points)
      : set{{points.begin(), points.end()}},
        index(3, set, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafSize)) {
    index.buildIndex();
  }

  PointSet set;
  nanoflann::KDTreeSingleIndexAdaptor<Metric, PointSet, 3, int> index;  ///< refers to `set`: do not move
};

PointIndex::PointIndex() = default;
PointIndex::PointIndex(std::span<const Vec3> points)
    : tree_(points.empty() ? nullptr : std::make_unique<Tree>(points)) {}
PointIndex::~PointIndex() = default;
PointIndex::PointIndex(PointIndex&&) noexcept = default;
PointIndex& PointIndex::operator=(PointIndex&&) noexcept = default;

PointIndex::Neighbour PointIndex::nearest(const Vec3& query, double max_distance_m) const {
  NearestOne result{max_distance_m * max_distance_m, {}};
  if (tree_) tree_->index.findNeighbors(result, query.data(), nanoflann::SearchParams());
  return result.best;
}

void PointIndex::nearest(const Vec3& query, int count, std::vector<Neighbour>& out) const {
  out.clear();
  if (!tree_ || count <= 0) return;
  NearestFew result{out, static_cast<std::size_t>(count)};
  tree_->index.findNeighbors(result, query.data(), nanoflann::SearchParams());
}

std::size_t PointIndex::size() const { return tree_ ? tree_->set.points.size() : 0; }

std::size_t PointIndex::memory_bytes() const {
  if (!tree_) return 0;
  return sizeof(Tree) + tree_->set.points.capacity() * sizeof(Vec3) + tree_->index.usedMemory(tree_->index);
}

}  // namespace hm
