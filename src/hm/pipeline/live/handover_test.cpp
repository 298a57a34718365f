#include "hm/pipeline/live/handover.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <cstdlib>
#include <future>
#include <thread>
#include <utility>
#include <vector>

namespace hm {
namespace {

using std::chrono::milliseconds;

/// Takes numbers until it has `wanted` of them.
struct Taker {
  explicit Taker(std::size_t wanted, milliseconds rest)
      : all(wanted), numbers([this] { return look(); }, milliseconds(1), rest) {}
  bool look() {
    std::vector<int> taken;
    numbers.take(taken);
    got.insert(got.end(), taken.begin(), taken.end());
    if (got.size() == all && !std::exchange(is_done, true)) done.set_value();
    return !taken.empty();
  }
  void give(int number) {
    numbers.give([number](std::vector<int>& waiting) { waiting.push_back(number); });
  }

  std::size_t all;
  std::vector<int> got;
  bool is_done = false;
  std::promise<void> done;
  Handover<std::vector<int>> numbers;
};

TEST(Handover, EverythingIsTakenOnceInTheOrderOfItsGiver) {
  constexpr int kEach = 2000;
  Taker taker(2 * kEach, milliseconds(50));
  {
    std::vector<std::jthread> givers;
    for (const int sign : {1, -1})
      givers.emplace_back([&taker, sign] {
        for (int i = 1; i <= kEach; ++i) taker.give(sign * i);
      });
  }
  taker.done.get_future().wait();
  std::vector<int> expected, positive, negative;
  for (const int number : taker.got) (number > 0 ? positive : negative).push_back(std::abs(number));
  for (int i = 1; i <= kEach; ++i) expected.push_back(i);
  EXPECT_EQ(positive, expected);
  EXPECT_EQ(negative, expected);
}

TEST(Handover, IsLookedAtAgainAfterARest) {
  Taker taker(2, milliseconds(0));  // it rests at once
  taker.give(1);
  std::this_thread::sleep_for(milliseconds(20));
  taker.give(2);
  taker.done.get_future().wait();
  EXPECT_THAT(taker.got, testing::ElementsAre(1, 2));
}

}  // namespace
}  // namespace hm
