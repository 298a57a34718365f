#include "hm/pipeline/live/newest_jobs.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <future>
#include <thread>
#include <utility>
#include <vector>

namespace hm {
namespace {

TEST(NewestJobs, TheNewestOfEachNameIsDoneLongestWaitingFirst) {
  std::vector<std::pair<int, int>> done;  // name, turn
  std::promise<void> started, go;
  NewestJobs<int> jobs;
  jobs.give(9, [&] {
    started.set_value();
    go.get_future().wait();
  });
  started.get_future().wait();
  int turn = 0;
  for (const int name : {5, 3, 9, 1, 3})
    jobs.give(name, [&done, name, at = turn++] { done.emplace_back(name, at); });
  go.set_value();
  jobs.wait();
  using Done = std::pair<int, int>;
  EXPECT_THAT(done, testing::ElementsAre(Done{5, 0}, Done{3, 4}, Done{9, 2}, Done{1, 3}));
}

TEST(NewestJobs, WhatWaitsAtTheEndIsDropped) {
  int done = 0;
  std::promise<void> started, go;
  std::jthread later;
  {
    NewestJobs<int> jobs;
    jobs.give(1, [&] {
      started.set_value();
      go.get_future().wait();
      ++done;
    });
    started.get_future().wait();
    jobs.give(2, [&] { ++done; });
    later = std::jthread([&go] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      go.set_value();
    });
  }
  EXPECT_EQ(done, 1);
}

}  // namespace
}  // namespace hm
