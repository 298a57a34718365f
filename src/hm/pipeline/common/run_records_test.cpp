#include "hm/pipeline/common/run_records.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

TEST(EvenlyThinned, KeepsAllUpToItsLimitAndEveryNthBeyond) {
  EvenlyThinned<std::size_t> kept(4);
  std::vector<std::vector<std::size_t>> expected{
      {0}, {0, 1}, {0, 1, 2}, {0, 1, 2, 3}, {0, 2, 4}, {0, 2, 4}, {0, 2, 4, 6}, {0, 2, 4, 6}, {0, 4, 8}};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    kept.push_back(i);
    EXPECT_EQ(kept.items(), expected[i]);
    EXPECT_EQ(kept.count(), i + 1);
  }
}

TEST(RunningSummary, IsThatOfAllNumbersThenOneOfBoundedMemory) {
  RunningSummary running;
  std::vector<double> all;
  Rng rng(7);
  for (int i = 0; i < 300'000; ++i) {
    all.push_back(std::exp(rng.normal()));
    running.add(all.back());
    if (i != 1000 && i != 32'767) continue;
    const Summary exact = summarise(all), ours = running.summary();
    EXPECT_EQ(ours.count, exact.count);
    EXPECT_EQ(ours.mean, exact.mean);
    EXPECT_EQ(ours.rmse, exact.rmse);
    EXPECT_EQ(ours.p99, exact.p99);
    EXPECT_EQ(ours.max, exact.max);
  }
  const Summary exact = summarise(all), ours = running.summary();
  EXPECT_EQ(ours.count, exact.count);
  EXPECT_EQ(ours.min, exact.min);
  EXPECT_EQ(ours.max, exact.max);
  EXPECT_NEAR(ours.mean, exact.mean, 1e-9);
  EXPECT_NEAR(ours.rmse, exact.rmse, 1e-9);
  EXPECT_GE(ours.median, quantile(all, 0.488));
  EXPECT_LE(ours.median, quantile(all, 0.512));
  EXPECT_GE(ours.p99, quantile(all, 0.987));
  EXPECT_LE(ours.p99, quantile(all, 0.993));
}

}  // namespace
}  // namespace hm
