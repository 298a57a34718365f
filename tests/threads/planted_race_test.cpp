// Races put in on purpose: ThreadSanitizer must report them, else its silence about the other tests of
// hm_threads_test would mean nothing (a suppression that is too wide, a file that is not instrumented).
#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <thread>

#include "hm/core/parallel.hpp"

namespace hm {
namespace {

constexpr int kExitCodeOfReports = 66;  // ThreadSanitizer's, when it has reported something

class PlantedRace : public testing::Test {
 protected:
  // Executed anew: a forked child would have the reports of the tests before.
  void SetUp() override { testing::GTEST_FLAG(death_test_style) = "threadsafe"; }
};

/// Two threads count in one variable without a lock.
[[noreturn]] void count_on_two_threads() {
  int count = 0;
  {
    const std::jthread other([&] { ++count; });
    ++count;
  }
  std::exit(count == 2 ? 0 : 1);
}

/// The bodies of a parallel loop add to one variable, or to one each. They wait, so that one thread does not
/// run them all before the other has started.
[[noreturn]] void add_in_a_parallel_loop(bool separate) {
  std::size_t sums[8] = {};
  ParallelLoop(2).for_ranges(8, 1, [&](std::size_t begin, std::size_t) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    sums[separate ? begin : 0] += begin;
  });
  std::size_t sum = 0;
  for (const std::size_t part : sums) sum += part;
  std::exit(sum <= 28 ? 0 : 1);
}

TEST_F(PlantedRace, BetweenTwoThreadsIsReported) {
  EXPECT_EXIT(count_on_two_threads(), testing::ExitedWithCode(kExitCodeOfReports), "data race");
}

TEST_F(PlantedRace, BetweenBodiesOfAParallelLoopIsReported) {
  EXPECT_EXIT(add_in_a_parallel_loop(false), testing::ExitedWithCode(kExitCodeOfReports), "data race");
}

TEST_F(PlantedRace, BodiesThatWriteSeparateMemoryAreNotReported) {
  EXPECT_EXIT(add_in_a_parallel_loop(true), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace hm
