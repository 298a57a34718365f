#include "hm/slam/place_recognition/descriptor_index.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "hm/slam/rgbd/testing/landmark_world.hpp"

namespace hm {
namespace {

using test::noisy;
using test::random_descriptor;

struct Known {
  DescriptorIndex index;
  std::vector<BinaryDescriptor> descriptors;
};

Known random_index(std::size_t count, Rng& rng) {
  Known known;
  for (std::uint32_t i = 0; i < count; ++i) {
    known.descriptors.push_back(random_descriptor(rng));
    known.index.add(known.descriptors.back(), {i / 100, i % 100});
  }
  return known;
}

TEST(DescriptorIndex, ExhaustiveSearchIsThatOfASortedList) {
  Rng rng(1);
  const Known known = random_index(500, rng);
  for (int trial = 0; trial < 20; ++trial) {
    const BinaryDescriptor query = random_descriptor(rng);
    std::vector<std::pair<int, std::uint32_t>> expected;
    for (std::uint32_t i = 0; i < 500; ++i)
      if (i / 100 != 2) expected.emplace_back(hamming_distance(query, known.descriptors[i]), i);
    std::sort(expected.begin(), expected.end());
    const auto found = known.index.nearest_exhaustive(query, {7, 110, 256, 2, 2});
    const auto within =
        std::count_if(expected.begin(), expected.end(), [](const auto& e) { return e.first <= 110; });
    ASSERT_EQ(found.size(), static_cast<std::size_t>(std::min<std::ptrdiff_t>(7, within)));
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].bits, expected[i].first);
      EXPECT_EQ(found[i].owner, (DescriptorOwner{expected[i].second / 100, expected[i].second % 100}));
    }
  }
}

/// With an unlimited number of checks, the trees' result is bit-identical to exhaustive search.
TEST(DescriptorIndex, TreesWithoutALimitFindEverything) {
  Rng rng(2);
  const Known known = random_index(3000, rng);
  for (int trial = 0; trial < 50; ++trial) {
    const BinaryDescriptor query = random_descriptor(rng);
    const DescriptorIndex::Query all{10, 256, 1000000, 5, 7};
    EXPECT_EQ(known.index.nearest(query, all), known.index.nearest_exhaustive(query, all));
  }
}

/// The same corner observed again (8 % of its bits wrong) among 30,000 random descriptors, the hardest case
/// for the trees: mostly found with a sixtieth of the comparisons, nearly always with a tenth.
TEST(DescriptorIndex, FindsWhatIsSeenAgain) {
  Rng rng(3);
  const Known known = random_index(30000, rng);
  constexpr int kTrials = 400;
  int few = 0, many = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::uint32_t which = rng.below(30000);
    const BinaryDescriptor seen = noisy(known.descriptors[which], 0.08, rng);
    const auto is_found = [&](int checks) {
      const auto nearest = known.index.nearest(seen, {1, 64, checks});
      return !nearest.empty() && nearest[0].owner == DescriptorOwner{which / 100, which % 100};
    };
    few += is_found(512) ? 1 : 0;
    many += is_found(3000) ? 1 : 0;
  }
  EXPECT_GE(few, 0.5 * kTrials);
  EXPECT_GE(many, 0.9 * kTrials);
  EXPECT_LT(known.index.memory_bytes(), 30000 * 450U);
}

TEST(DescriptorIndex, EqualDescriptorsAndEmptiness) {
  DescriptorIndex index;
  EXPECT_TRUE(index.nearest({}, {}).empty());
  EXPECT_TRUE(index.nearest_exhaustive({}, {}).empty());
  for (std::uint32_t i = 0; i < 500; ++i) index.add(BinaryDescriptor{1, 2, 3, 4}, {0, i});
  const auto nearest = index.nearest({1, 2, 3, 4}, {3, 0, 100000});
  ASSERT_EQ(nearest.size(), 3U);
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(nearest[i], (DescriptorNeighbour{{0, i}, 0}));
  EXPECT_TRUE(index.nearest({1, 2, 3, 4}, {0, 256, 1000}).empty());
  EXPECT_TRUE(index.nearest({0, 0, 0, 0}, {5, 1, 1000}).empty());
}

TEST(DescriptorIndex, GrowsTheSameWay) {
  Rng one(4), other(4);
  const Known a = random_index(2000, one), b = random_index(2000, other);
  for (int trial = 0; trial < 50; ++trial) {
    const BinaryDescriptor query = random_descriptor(one);
    EXPECT_EQ(a.index.nearest(query, {}), b.index.nearest(query, {}));
  }
}

}  // namespace
}  // namespace hm
