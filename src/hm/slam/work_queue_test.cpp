#include "hm/slam/work_queue.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <new>
#include <thread>
#include <vector>

namespace hm {
namespace {

TEST(WorkQueue, ProcessesInOrderOnAnotherThread) {
  std::vector<int> processed;
  std::thread::id thread;
  WorkQueue<int> queue([&](int item) {
    processed.push_back(item);
    thread = std::this_thread::get_id();
  });
  for (int i = 0; i < 100; ++i) queue.add(i);
  queue.wait();
  EXPECT_EQ(queue.waiting(), 0u);
  ASSERT_EQ(processed.size(), 100u);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(processed[static_cast<std::size_t>(i)], i);
  EXPECT_NE(thread, std::this_thread::get_id());
}

TEST(WorkQueue, CountsWhatIsProcessedAmongThoseThatWait) {
  std::promise<void> begun, go_on;
  WorkQueue<int> queue([&](int) {
    begun.set_value();
    go_on.get_future().wait();
  });
  queue.add(0);
  begun.get_future().wait();
  EXPECT_EQ(queue.waiting(), 1u);
  go_on.set_value();
  queue.wait();
  EXPECT_EQ(queue.waiting(), 0u);
}

TEST(WorkQueue, ThrowsWhatProcessingThrewFromThenOn) {
  std::vector<int> processed;
  WorkQueue<int> queue([&](int item) {
    if (item == 1) throw std::bad_alloc();
    processed.push_back(item);
  });
  queue.add(0);
  queue.wait();
  queue.add(1);
  EXPECT_THROW(queue.wait(), std::bad_alloc);
  EXPECT_THROW(queue.add(2), std::bad_alloc);
  EXPECT_THROW(queue.wait(), std::bad_alloc);
  EXPECT_EQ(processed, (std::vector<int>{0}));
}

TEST(WorkQueue, DropsWhatWaitsBehindAFailure) {
  std::promise<void> go_on;
  std::vector<int> processed;
  WorkQueue<int> queue([&](int item) {
    if (item == 0) {
      go_on.get_future().wait();
      throw std::bad_alloc();
    }
    processed.push_back(item);
  });
  queue.add(0);
  queue.add(1);
  go_on.set_value();
  EXPECT_THROW(queue.wait(), std::bad_alloc);
  EXPECT_TRUE(processed.empty());
}

TEST(WorkQueue, DropsWhatWaitsWhenItEnds) {
  std::promise<void> begun;
  std::size_t processed = 0;
  {
    WorkQueue<int> queue([&](int) {
      if (processed++ == 0) begun.set_value();
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    });
    for (int i = 0; i < 100; ++i) queue.add(i);
    begun.get_future().wait();
  }
  EXPECT_LT(processed, 100u);
}

}  // namespace
}  // namespace hm
