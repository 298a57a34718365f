#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hm/odometry/feature/feature.hpp"

namespace hm {

/// Keyframe and feature that a descriptor belongs to, by index.
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

/// Incremental approximate nearest-neighbour index of binary descriptors: several random hierarchical
/// clustering trees, searched best branch first (Muja and Lowe, "Fast Matching of Binary Features", CRV
/// 2012). Adding and searching cost O(log size). Deterministic. Const members may be called from several
/// threads.
class DescriptorIndex {
 public:
  explicit DescriptorIndex(const DescriptorIndexParams& params = {});
  ~DescriptorIndex();
  DescriptorIndex(DescriptorIndex&&) noexcept;
  DescriptorIndex& operator=(DescriptorIndex&&) noexcept;

  void add(const BinaryDescriptor& descriptor, DescriptorOwner owner);
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] std::size_t memory_bytes() const;

  /// Limits of a search.
  struct Query {
    int neighbours = 4;
    int max_bits = 256;                       ///< maximum distance of neighbours
    int max_checks = 512;                     ///< approximate number of descriptors compared
    std::uint32_t exclude_from = UINT32_MAX;  ///< first excluded keyframe
    std::uint32_t exclude_to = 0;             ///< last excluded keyframe
  };
  /// Approximate nearest descriptors, at most query.neighbours, by distance, then by owner.
  [[nodiscard]] std::vector<DescriptorNeighbour> nearest(const BinaryDescriptor& descriptor,
                                                         const Query& query) const;
  /// Exact nearest descriptors by exhaustive search.
  [[nodiscard]] std::vector<DescriptorNeighbour> nearest_exhaustive(const BinaryDescriptor& descriptor,
                                                                    const Query& query) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
