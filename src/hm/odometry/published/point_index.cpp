#include "hm/odometry/published/point_index.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace hm {

namespace {

constexpr int kLeafSize = 8;
constexpr int kMaxDepth = 40;  ///< halving more than 2^31 points takes less

/// The best `count` so far, sorted; the search's bound is the worst of them once there are enough.
struct Best {
  std::vector<PointIndex::Neighbour>& sorted;
  std::size_t count;
  double limit;

  [[nodiscard]] double bound() const {
    return sorted.size() < count ? limit : sorted.back().squared_distance_m2;
  }
  void offer(const PointIndex::Neighbour& candidate) {
    if (sorted.size() == count && !(candidate < sorted.back())) return;
    if (sorted.size() == count) sorted.pop_back();
    sorted.insert(std::upper_bound(sorted.begin(), sorted.end(), candidate), candidate);
  }
};

/// The best one so far, nearer than the limit.
struct BestOne {
  PointIndex::Neighbour best;
  double limit;
  [[nodiscard]] double bound() const { return best.index < 0 ? limit : best.squared_distance_m2; }
  void offer(const PointIndex::Neighbour& candidate) {
    const bool better = best.index < 0 ? candidate.squared_distance_m2 < limit : candidate < best;
    if (better) best = candidate;
  }
};

}  // namespace

PointIndex::PointIndex(std::span<const Vec3> points) {
  items_.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) items_.push_back({points[i], static_cast<int>(i)});
  nodes_.emplace_back();
  build(0, 0, static_cast<int>(items_.size()));
}

void PointIndex::build(int node, int begin, int end) {
  if (end - begin <= kLeafSize) {
    nodes_[static_cast<std::size_t>(node)] = {-1, 0, begin, end};
    return;
  }
  Vec3 low = items_[static_cast<std::size_t>(begin)].point;
  Vec3 high = low;
  for (int i = begin + 1; i < end; ++i) {
    low = low.cwiseMin(items_[static_cast<std::size_t>(i)].point);
    high = high.cwiseMax(items_[static_cast<std::size_t>(i)].point);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const int middle = begin + (end - begin) / 2;
  std::nth_element(items_.begin() + begin, items_.begin() + middle, items_.begin() + end,
                   [axis](const Item& a, const Item& b) {
                     return a.point(axis) != b.point(axis) ? a.point(axis) < b.point(axis)
                                                           : a.index < b.index;
                   });
  const int children = static_cast<int>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[static_cast<std::size_t>(node)] = {axis, items_[static_cast<std::size_t>(middle)].point(axis),
                                            children, 0};
  build(children, begin, middle);
  build(children + 1, middle, end);
}

template <class Visit>
void PointIndex::visit(const Vec3& query, Visit& state) const {
  if (nodes_.empty()) return;
  struct Pending {
    int node;
    double squared_distance;  ///< at least, from the query to the node's side of its split
  };
  std::array<Pending, kMaxDepth> stack;
  std::size_t size = 0;
  stack[size++] = {0, 0.0};
  while (size > 0) {
    const Pending next = stack[--size];
    if (next.squared_distance > state.bound()) continue;
    const Node& node = nodes_[static_cast<std::size_t>(next.node)];
    if (node.axis < 0) {
      for (int i = node.first; i < node.end; ++i) {
        const Item& item = items_[static_cast<std::size_t>(i)];
        state.offer({item.index, (item.point - query).squaredNorm()});
      }
      continue;
    }
    const double beyond = query(node.axis) - node.split;
    const int near = beyond < 0 ? node.first : node.first + 1;
    const int far = beyond < 0 ? node.first + 1 : node.first;
    stack[size++] = {far, std::max(next.squared_distance, beyond * beyond)};
    stack[size++] = {near, next.squared_distance};
  }
}

PointIndex::Neighbour PointIndex::nearest(const Vec3& query, double max_distance_m) const {
  BestOne state{{}, max_distance_m * max_distance_m};
  visit(query, state);
  return state.best;
}

void PointIndex::nearest(const Vec3& query, int count, std::vector<Neighbour>& out) const {
  out.clear();
  Best state{out, static_cast<std::size_t>(count), std::numeric_limits<double>::infinity()};
  if (count > 0) visit(query, state);
}

std::size_t PointIndex::memory_bytes() const {
  return items_.capacity() * sizeof(Item) + nodes_.capacity() * sizeof(Node);
}

}  // namespace hm
