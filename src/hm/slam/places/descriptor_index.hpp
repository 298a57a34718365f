#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hm/odometry/feature/feature.hpp"

namespace hm {

/// Whose descriptor: keyframe and feature, by number.
struct DescriptorOwner {
  std::uint32_t keyframe = 0, feature = 0;
  bool operator==(const DescriptorOwner&) const = default;
};

struct DescriptorNeighbour {
  DescriptorOwner owner;
  int bits = 0;  ///< Hamming distance
  bool operator==(const DescriptorNeighbour&) const = default;
};

struct DescriptorIndexParams {
  int trees = 4;
  int branches = 8;
  int leaf_size = 256;
};

/// Nearest neighbours among binary descriptors that keep coming: a few random trees of cluster centres, grown
/// at the leaves, searched best branch first (Muja and Lowe, "Fast Matching of Binary Features", CRV 2012).
/// Adding and searching cost O(log size). Deterministic. Const members may be called from several threads.
class DescriptorIndex {
 public:
  explicit DescriptorIndex(const DescriptorIndexParams& params = {});
  ~DescriptorIndex();
  DescriptorIndex(DescriptorIndex&&) noexcept;
  DescriptorIndex& operator=(DescriptorIndex&&) noexcept;

  void add(const BinaryDescriptor& descriptor, DescriptorOwner owner);
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] std::size_t memory_bytes() const;

  /// How a search ends.
  struct Query {
    int neighbours = 4;
    int max_bits = 256;                       ///< neighbours further away are left out
    int max_checks = 512;                     ///< descriptors compared, about
    std::uint32_t exclude_from = UINT32_MAX;  ///< keyframes from here ...
    std::uint32_t exclude_to = 0;             ///< ... to here (included) are left out
  };
  /// The nearest descriptors found, nearest first, equals by owner. At most query.neighbours.
  [[nodiscard]] std::vector<DescriptorNeighbour> nearest(const BinaryDescriptor& descriptor,
                                                         const Query& query) const;
  /// The nearest descriptors, by comparing with every one: the exact answer that nearest() approximates.
  [[nodiscard]] std::vector<DescriptorNeighbour> nearest_exhaustive(const BinaryDescriptor& descriptor,
                                                                    const Query& query) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
