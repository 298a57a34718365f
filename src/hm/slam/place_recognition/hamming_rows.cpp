#include "hm/slam/place_recognition/hamming_rows.hpp"

#include "hm/core/check.hpp"
#include "hm/odometry/feature/with_popcount.hpp"

namespace hm::detail {

HM_WITH_POPCOUNT void hamming_row(const BinaryDescriptor& descriptor,
                                  std::span<const BinaryDescriptor> others, std::span<std::uint16_t> bits) {
  HM_CHECK(bits.size() == others.size(), "{} places for {} distances", bits.size(), others.size());
  for (std::size_t i = 0; i < others.size(); ++i) {
    int sum = 0;
    for (std::size_t w = 0; w < descriptor.size(); ++w)
      sum += __builtin_popcountll(descriptor[w] ^ others[i][w]);
    bits[i] = static_cast<std::uint16_t>(sum);
  }
}

HM_WITH_POPCOUNT std::size_t nearest_of(const BinaryDescriptor& descriptor,
                                        std::span<const BinaryDescriptor> others) {
  HM_CHECK(!others.empty());
  std::size_t nearest = 0;
  int least = 257;
  for (std::size_t i = 0; i < others.size(); ++i) {
    int sum = 0;
    for (std::size_t w = 0; w < descriptor.size(); ++w)
      sum += __builtin_popcountll(descriptor[w] ^ others[i][w]);
    if (sum >= least) continue;
    least = sum;
    nearest = i;
  }
  return nearest;
}

}  // namespace hm::detail
