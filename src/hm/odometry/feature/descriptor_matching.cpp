#include "hm/odometry/feature/descriptor_matching.hpp"

#include "hm/odometry/feature/with_popcount.hpp"

namespace hm {

namespace {

constexpr int kFar_bits = 257;

struct Nearest {
  int index = -1;
  int best_bits = kFar_bits, second_bits = kFar_bits;
};

/// Descriptors in a row, with the features they belong to.
struct Descriptors {
  std::vector<BinaryDescriptor> bits;
  std::vector<int> feature;
};

Descriptors gather(const FeatureSet& features, bool only_with_depth) {
  Descriptors all;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (only_with_depth && !features[i].has_depth) continue;
    all.bits.push_back(features[i].descriptor);
    all.feature.push_back(static_cast<int>(i));
  }
  return all;
}

HM_WITH_POPCOUNT void find_nearest(const std::vector<BinaryDescriptor>& from,
                                   const std::vector<BinaryDescriptor>& to, std::vector<Nearest>& nearest) {
  for (std::size_t i = 0; i < from.size(); ++i) {
    Nearest n;
    for (std::size_t j = 0; j < to.size(); ++j) {
      int bits = 0;
      for (std::size_t word = 0; word < 4; ++word) bits += __builtin_popcountll(from[i][word] ^ to[j][word]);
      if (bits < n.best_bits) {
        n = {static_cast<int>(j), bits, n.best_bits};
      } else if (bits < n.second_bits) {
        n.second_bits = bits;
      }
    }
    nearest[i] = n;
  }
}

}  // namespace

std::vector<FeatureMatch> match_descriptors(const FeatureSet& a, const FeatureSet& b,
                                            const MatchLimits& limits) {
  const Descriptors in_a = gather(a, limits.only_with_depth);
  const Descriptors in_b = gather(b, limits.only_with_depth);
  std::vector<Nearest> of_b(in_b.bits.size());
  find_nearest(in_b.bits, in_a.bits, of_b);
  std::vector<Nearest> of_a(limits.mutual ? in_a.bits.size() : 0);
  if (limits.mutual) find_nearest(in_a.bits, in_b.bits, of_a);
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < of_b.size(); ++i) {
    const Nearest& n = of_b[i];
    if (n.index < 0 || n.best_bits > limits.max_distance_bits) continue;
    const bool has_second = n.second_bits < kFar_bits;
    if (limits.max_ratio < 1 && has_second && n.best_bits >= limits.max_ratio * n.second_bits) continue;
    const auto j = static_cast<std::size_t>(n.index);
    if (limits.mutual && of_a[j].index != static_cast<int>(i)) continue;
    matches.push_back({in_a.feature[j], in_b.feature[i], n.best_bits});
  }
  return matches;
}

}  // namespace hm
