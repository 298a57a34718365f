#include "hm/station/web/client_rates.hpp"

#include <gtest/gtest.h>

namespace hm {
namespace {

constexpr Duration at(double seconds) { return {static_cast<std::int64_t>(seconds * 1e9)}; }

TEST(ClientRates, LetsABurstThroughThenTheRate) {
  ClientRates rates(100);
  int taken = 0;
  for (int i = 0; i < 1000; ++i) taken += rates.take("a", at(5)) ? 1 : 0;
  EXPECT_EQ(taken, 200);
  for (int i = 0; i < 1000; ++i) taken += rates.take("a", at(5 + 0.01 * i)) ? 1 : 0;
  EXPECT_NEAR(taken, 200 + 999, 2);  // one in 10 ms is within the rate
}

TEST(ClientRates, OneClientIsNotInTheWayOfAnother) {
  ClientRates rates(10);
  for (int i = 0; i < 100; ++i) rates.take("greedy", at(1));
  EXPECT_FALSE(rates.take("greedy", at(1)));
  EXPECT_TRUE(rates.take("other", at(1)));
  EXPECT_TRUE(rates.take("greedy", at(2)));
}

TEST(ClientRates, KnowsClientsByTheirAddressOrNetworkButNotThisMachine) {
  for (const char* own : {"127.0.0.1", "127.8.8.8", "::1", "::ffff:127.0.0.1"})
    EXPECT_EQ(rated_client(own), std::nullopt) << own;
  EXPECT_EQ(rated_client("192.168.1.7"), "192.168.1.7");
  EXPECT_EQ(rated_client("::ffff:192.168.1.7"), "192.168.1.7");
  EXPECT_EQ(rated_client("2001:db8:1:2:3:4:5:6"), "2001:db8:1:2::/64");
  EXPECT_EQ(rated_client("2001:db8:1:2:ffff::1"), "2001:db8:1:2::/64");
  EXPECT_NE(rated_client("2001:db8:1:3::1"), rated_client("2001:db8:1:2::1"));
  EXPECT_EQ(rated_client("fe80::1%eth0"), "fe80::/64");
}

TEST(ClientRates, KeepsABoundedNumberOfClients) {
  ClientRates rates(10);
  for (int i = 0; i < 100; ++i) rates.take("greedy", at(0));
  for (int i = 0; i < 100'000; ++i) {
    EXPECT_TRUE(rates.take(std::to_string(i), at(1e-2 * i)));
    ASSERT_LE(rates.clients(), ClientRates::kMaxClients);
  }
  ClientRates flooded(10);
  for (int i = 0; i < 10'000; ++i) {
    EXPECT_TRUE(flooded.take(std::to_string(i), at(0)));
    ASSERT_LE(flooded.clients(), ClientRates::kMaxClients);
  }
}

}  // namespace
}  // namespace hm
