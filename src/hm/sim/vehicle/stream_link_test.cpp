#include "hm/sim/vehicle/stream_link.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

namespace hm {
namespace {

Time at(double seconds) { return Time::from_seconds(seconds); }

TEST(StreamLink, DelaysByLatencyAndJitterInOrder) {
  StreamLink<int> link({0.020, 0.004}, 5);
  for (int i = 0; i < 1000; ++i) link.send(at(0.001 * i), i);
  EXPECT_FALSE(link.receive(at(0.0199)));
  double least = 1, greatest = 0;
  Time last{};
  for (int i = 0; i < 1000; ++i) {
    const auto arrival = link.receive(at(10));
    ASSERT_TRUE(arrival);
    EXPECT_EQ(arrival->message, i);
    EXPECT_GE(arrival->at, last);
    last = arrival->at;
    const double delay = (arrival->at - at(0.001 * i)).seconds();
    least = std::min(least, delay), greatest = std::max(greatest, delay);
  }
  EXPECT_GE(least, 0.020);
  EXPECT_LE(greatest, 0.024 + 1e-9);
  EXPECT_GT(greatest - least, 0.003);
  EXPECT_FALSE(link.receive(at(10)));
}

TEST(StreamLink, BandwidthDelaysAndOverflows) {
  StreamLinkParams params;
  params.bytes_per_s = 46080;
  params.max_queue_s = 0.05;
  StreamLink<int> link(params, 1);
  for (int i = 0; i < 10; ++i) link.send(at(1), i, 1000);  // 21.7 ms each: the fourth would wait 65 ms
  for (int i = 0; i < 3; ++i) {
    const auto arrival = link.receive(at(2));
    ASSERT_TRUE(arrival);
    EXPECT_NEAR(arrival->at.seconds(), 1 + (i + 1) * 1000 / 46080.0, 1e-8);
  }
  EXPECT_FALSE(link.receive(at(2)));
  EXPECT_EQ(link.counts().overflown, 7U);
  link.send(at(3), 10, 1000);  // the queue is empty again
  EXPECT_TRUE(link.receive(at(3.022)));
}

TEST(StreamLink, CutLosesWhatIsSentMeanwhile) {
  StreamLink<int> link({0.01}, 1);
  link.send(at(0), 1);
  link.set_faults(true, false);
  link.send(at(0.005), 2);
  link.set_faults(false, false);
  link.send(at(0.006), 3);
  EXPECT_EQ(link.receive(at(1))->message, 1);
  EXPECT_EQ(link.receive(at(1))->message, 3);
  EXPECT_EQ(link.counts().sent, 3U);
  EXPECT_EQ(link.counts().cut, 1U);
}

TEST(StreamLink, InvertsBitsAtTheAskedRate) {
  StreamLinkParams params;
  params.bit_error_ratio = 1e-4;
  StreamLink<std::vector<std::uint8_t>> link(params, 9);
  std::size_t inverted = 0, damaged = 0;
  std::vector<int> of_bit(8, 0);
  constexpr int kMessages = 10'000, kBytes = 100;
  for (int i = 0; i < kMessages; ++i) {
    link.send(at(i), std::vector<std::uint8_t>(kBytes, 0xa5));
    const auto arrival = link.receive(at(i));
    ASSERT_TRUE(arrival);
    std::size_t here = 0;
    for (const std::uint8_t byte : arrival->message)
      for (unsigned bit = 0; bit < 8; ++bit)
        if (((byte ^ 0xa5U) >> bit) & 1U) ++of_bit[bit], ++here;
    inverted += here;
    damaged += here > 0 ? 1 : 0;
  }
  const double bits = 8.0 * kMessages * kBytes, expected = 1e-4 * bits;
  EXPECT_NEAR(static_cast<double>(inverted), expected, 5 * std::sqrt(expected));
  for (const int count : of_bit) EXPECT_NEAR(count, expected / 8, 5 * std::sqrt(expected / 8));
  EXPECT_EQ(link.counts().damaged, damaged);
}

TEST(StreamLink, LosesDamagedMessagesThatAreNotBytes) {
  StreamLink<int> link({}, 4);
  link.set_faults(false, true);
  constexpr int kMessages = 20'000, kBytes = 64;
  int arrived = 0;
  for (int i = 0; i < kMessages; ++i) {
    link.send(at(i), i, kBytes);
    arrived += link.receive(at(i)) ? 1 : 0;
  }
  const double sound = std::pow(1 - LinkChannel::kFaultBitErrorRatio, 8 * kBytes);
  EXPECT_NEAR(arrived, kMessages * sound, 5 * std::sqrt(kMessages * sound * (1 - sound)));
  link.set_faults(false, false);
  link.send(at(kMessages), 0, kBytes);
  EXPECT_TRUE(link.receive(at(kMessages)));
}

}  // namespace
}  // namespace hm
