#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/io/laser/laser_log.hpp"

/// Stamps that a logger printed as seconds, a point, and microseconds without their leading zeros.
namespace hm::detail {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// Output of such a logger for a time.
Time printed(Time time) {
  const std::string micros = std::to_string(time.ns % kSecond_ns / 1000);
  std::string padded = micros + std::string(6 - micros.size(), '0');
  return Time{time.ns / kSecond_ns * kSecond_ns + std::stoll(padded) * 1000};
}

TEST(LostZeros, AreFoundAgain) {
  Rng rng(3);
  std::vector<Time> truth, written;
  std::int64_t micros = 976'053'557'767'368;
  for (int i = 0; i < 3000; ++i) {
    truth.push_back(Time{micros * 1000});
    written.push_back(printed(truth.back()));
    micros += 150'000 + static_cast<std::int64_t>(rng.below(400'000));
  }
  const auto corrected = stamps_with_lost_zeros(written);
  ASSERT_FALSE(corrected.empty());
  std::vector<Time> after = written;
  std::size_t right = 0;
  for (Time& stamp : after)
    for (const CorrectedStamp& fix : corrected)
      if (fix.written == stamp) {
        stamp = fix.corrected;
        break;
      }
  double worst_s = 0;
  for (std::size_t i = 0; i < after.size(); ++i) {
    if (i > 0) {
      ASSERT_LT(after[i - 1], after[i]);
    }
    right += after[i] == truth[i];
    worst_s = std::max(worst_s, std::fabs((after[i] - truth[i]).seconds()));
  }
  // Some wrong stamps do not disturb the order; those cannot be told from right ones.
  EXPECT_GT(right, 2800U);
  EXPECT_LT(worst_s, 0.9);
}

TEST(LostZeros, RightStampsStay) {
  std::vector<Time> stamps;
  for (int i = 0; i < 100; ++i) stamps.push_back(Time{kSecond_ns + i * kSecond_ns / 10});
  EXPECT_TRUE(stamps_with_lost_zeros(stamps).empty());
}

TEST(LostZeros, OtherDisorderIsNotExplainedByThem) {
  Rng rng(5);
  std::vector<Time> stamps;
  for (int i = 0; i < 500; ++i)
    stamps.push_back(Time{static_cast<std::int64_t>(rng.below(1'000'000)) * 1'000'000});
  EXPECT_TRUE(stamps_with_lost_zeros(stamps).empty());
  EXPECT_TRUE(stamps_with_lost_zeros({}).empty());
}

}  // namespace
}  // namespace hm::detail
