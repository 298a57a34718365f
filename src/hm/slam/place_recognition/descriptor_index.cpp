#include "hm/slam/place_recognition/descriptor_index.hpp"

#include <algorithm>
#include <array>
#include <tuple>

#include "hm/core/check.hpp"
#include "hm/core/rng.hpp"
#include "hm/slam/place_recognition/hamming_rows.hpp"

namespace hm {
namespace {

constexpr std::uint64_t kTreeSeed = 20130501;
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// Node of a tree: children are stored consecutively from `first_child`, one per centre; a leaf has neither.
struct TreeNode {
  std::vector<BinaryDescriptor> centres;
  std::size_t first_child = kNone;
  std::vector<std::uint32_t> members;         ///< of a leaf
  std::vector<BinaryDescriptor> descriptors;  ///< of the members, contiguous for sequential access
  std::size_t limit = 0;                      ///< a leaf with more members is split
  [[nodiscard]] bool is_leaf() const { return first_child == kNone; }
};

/// Nearest neighbours found so far, in order; duplicates from several trees count once.
class BestList {
 public:
  BestList(int neighbours, int max_bits)
      : limit_(static_cast<std::size_t>(std::max(0, neighbours))), max_bits_(max_bits) {}
  /// True if a neighbour at this distance would be inserted.
  [[nodiscard]] bool wants(int bits) const {
    return bits <= max_bits_ && limit_ > 0 && (best_.size() < limit_ || bits <= best_.back().bits);
  }
  void offer(const DescriptorNeighbour& neighbour) {
    const auto place = std::lower_bound(best_.begin(), best_.end(), neighbour, before);
    if (place != best_.end() && *place == neighbour) return;
    best_.insert(place, neighbour);
    if (best_.size() > limit_) best_.pop_back();
  }
  [[nodiscard]] std::vector<DescriptorNeighbour> take() { return std::move(best_); }

 private:
  static bool before(const DescriptorNeighbour& a, const DescriptorNeighbour& b) {
    return std::tie(a.bits, a.owner.keyframe, a.owner.feature) <
           std::tie(b.bits, b.owner.keyframe, b.owner.feature);
  }
  std::size_t limit_;
  int max_bits_;
  std::vector<DescriptorNeighbour> best_;
};

bool is_excluded(const DescriptorOwner& owner, const DescriptorIndex::Query& query) {
  return owner.keyframe >= query.exclude_from && owner.keyframe <= query.exclude_to;
}

}  // namespace

struct DescriptorIndex::Impl {
  DescriptorIndexParams params;
  std::vector<BinaryDescriptor> descriptors;
  std::vector<DescriptorOwner> owners;
  std::vector<std::vector<TreeNode>> trees;  ///< each tree's first node is its root
  Rng rng{kTreeSeed};

  /// Unvisited branch: distance to its centre, tree and node packed into one number that sorts by distance.
  using Branch = std::uint64_t;
  static Branch branch(int bits, std::uint32_t tree, std::size_t node) {
    return (static_cast<Branch>(bits) << 48) | (static_cast<Branch>(tree) << 40) | node;
  }

  void insert(std::vector<TreeNode>& tree, std::uint32_t id);
  void split(std::vector<TreeNode>& tree, std::size_t node);
  int descend(std::uint32_t tree, std::size_t node, const BinaryDescriptor& descriptor, const Query& query,
              std::vector<Branch>& open, BestList& best) const;
  void compare(const TreeNode& leaf, const BinaryDescriptor& descriptor, const Query& query,
               BestList& best) const;
};

DescriptorIndex::DescriptorIndex(const DescriptorIndexParams& params) : impl_(std::make_unique<Impl>()) {
  HM_CHECK(params.trees > 0 && params.trees < 256 && params.branches > 1 && params.branches <= 64 &&
               params.leaf_size >= params.branches,
           "{} trees of {}, {} a leaf", params.trees, params.branches, params.leaf_size);
  impl_->params = params;
  TreeNode root;
  root.limit = static_cast<std::size_t>(params.leaf_size);
  impl_->trees.assign(static_cast<std::size_t>(params.trees), {root});
}
DescriptorIndex::~DescriptorIndex() = default;
DescriptorIndex::DescriptorIndex(DescriptorIndex&&) noexcept = default;
DescriptorIndex& DescriptorIndex::operator=(DescriptorIndex&&) noexcept = default;

void DescriptorIndex::add(const BinaryDescriptor& descriptor, DescriptorOwner owner) {
  const auto id = static_cast<std::uint32_t>(impl_->descriptors.size());
  impl_->descriptors.push_back(descriptor);
  impl_->owners.push_back(owner);
  for (auto& tree : impl_->trees) impl_->insert(tree, id);
}

void DescriptorIndex::Impl::insert(std::vector<TreeNode>& tree, std::uint32_t id) {
  std::size_t at = 0;
  while (!tree[at].is_leaf())
    at = tree[at].first_child + detail::nearest_of(descriptors[id], tree[at].centres);
  tree[at].members.push_back(id);
  tree[at].descriptors.push_back(descriptors[id]);
  if (tree[at].members.size() > tree[at].limit) split(tree, at);
}

/// Splits a leaf around randomly chosen members. If all members are equal, it stays a leaf with twice the
/// limit.
void DescriptorIndex::Impl::split(std::vector<TreeNode>& tree, std::size_t node) {
  std::vector<std::uint32_t> members = std::move(tree[node].members);
  std::vector<BinaryDescriptor> centres;
  for (int tries = 0;
       tries < 4 * params.branches && centres.size() < static_cast<std::size_t>(params.branches); ++tries) {
    const BinaryDescriptor& chosen =
        descriptors[members[rng.below(static_cast<std::uint32_t>(members.size()))]];
    if (std::find(centres.begin(), centres.end(), chosen) == centres.end()) centres.push_back(chosen);
  }
  if (centres.size() < 2) {
    tree[node].limit *= 2;
    tree[node].members = std::move(members);
    return;
  }
  const std::size_t first = tree.size();
  tree.resize(first + centres.size());
  for (std::size_t c = 0; c < centres.size(); ++c)
    tree[first + c].limit = static_cast<std::size_t>(params.leaf_size);
  for (const std::uint32_t id : members) {
    TreeNode& leaf = tree[first + detail::nearest_of(descriptors[id], centres)];
    leaf.members.push_back(id);
    leaf.descriptors.push_back(descriptors[id]);
  }
  tree[node].centres = std::move(centres);
  tree[node].first_child = first;
  tree[node].members = {};
  tree[node].descriptors = {};
}

std::size_t DescriptorIndex::size() const { return impl_->descriptors.size(); }

std::size_t DescriptorIndex::memory_bytes() const {
  std::size_t bytes = impl_->descriptors.capacity() * sizeof(BinaryDescriptor) +
                      impl_->owners.capacity() * sizeof(DescriptorOwner);
  for (const auto& tree : impl_->trees)
    for (const TreeNode& node : tree)
      bytes += sizeof(TreeNode) + node.centres.capacity() * sizeof(BinaryDescriptor) +
               node.members.capacity() * sizeof(std::uint32_t) +
               node.descriptors.capacity() * sizeof(BinaryDescriptor);
  return bytes;
}

/// Descends to the nearest leaf, queueing the other branches, and compares the descriptors there.
int DescriptorIndex::Impl::descend(std::uint32_t tree, std::size_t node, const BinaryDescriptor& descriptor,
                                   const Query& query, std::vector<Branch>& open, BestList& best) const {
  const std::vector<TreeNode>& nodes = trees[tree];
  std::array<std::uint16_t, 64> bits{};
  int checks = 0;
  while (!nodes[node].is_leaf()) {
    const TreeNode& inner = nodes[node];
    const std::size_t count = inner.centres.size();
    detail::hamming_row(descriptor, inner.centres, std::span(bits).first(count));
    checks += static_cast<int>(count);
    const std::size_t nearest = static_cast<std::size_t>(
        std::min_element(bits.begin(), bits.begin() + static_cast<std::ptrdiff_t>(count)) - bits.begin());
    for (std::size_t c = 0; c < count; ++c)
      if (c != nearest) open.push_back(branch(bits[c], tree, inner.first_child + c));
    node = inner.first_child + nearest;
  }
  compare(nodes[node], descriptor, query, best);
  return checks + static_cast<int>(nodes[node].members.size());
}

void DescriptorIndex::Impl::compare(const TreeNode& leaf, const BinaryDescriptor& descriptor,
                                    const Query& query, BestList& best) const {
  std::array<std::uint16_t, 64> bits{};
  for (std::size_t first = 0; first < leaf.members.size(); first += bits.size()) {
    const std::size_t count = std::min(leaf.members.size() - first, bits.size());
    detail::hamming_row(descriptor, std::span(leaf.descriptors).subspan(first, count),
                        std::span(bits).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      if (!best.wants(bits[i])) continue;
      const DescriptorOwner& owner = owners[leaf.members[first + i]];
      if (!is_excluded(owner, query)) best.offer({owner, bits[i]});
    }
  }
}

std::vector<DescriptorNeighbour> DescriptorIndex::nearest(const BinaryDescriptor& descriptor,
                                                          const Query& query) const {
  BestList best(query.neighbours, query.max_bits);
  std::vector<Impl::Branch> open;
  open.reserve(256);
  int checks = 0;
  for (std::uint32_t tree = 0; tree < impl_->trees.size(); ++tree)
    checks += impl_->descend(tree, 0, descriptor, query, open, best);
  while (checks < query.max_checks && !open.empty()) {
    // Few branches are visited: searching for the minimum is cheaper than keeping them sorted.
    const auto nearest_branch = std::min_element(open.begin(), open.end());
    const auto tree = static_cast<std::uint32_t>((*nearest_branch >> 40) & 0xff);
    const auto node = static_cast<std::size_t>(*nearest_branch & ((Impl::Branch{1} << 40) - 1));
    *nearest_branch = open.back();
    open.pop_back();
    checks += impl_->descend(tree, node, descriptor, query, open, best);
  }
  return best.take();
}

std::vector<DescriptorNeighbour> DescriptorIndex::nearest_exhaustive(const BinaryDescriptor& descriptor,
                                                                     const Query& query) const {
  BestList best(query.neighbours, query.max_bits);
  std::vector<std::uint16_t> bits(size());
  detail::hamming_row(descriptor, impl_->descriptors, bits);
  for (std::size_t id = 0; id < bits.size(); ++id)
    if (best.wants(bits[id]) && !is_excluded(impl_->owners[id], query))
      best.offer({impl_->owners[id], bits[id]});
  return best.take();
}

}  // namespace hm
