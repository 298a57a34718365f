// hm: compiled alone, for under ThreadSanitizer this file is not instrumented (src/CMakeLists.txt).
#include "hm/core/parallel.hpp"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "hm/core/check.hpp"

#ifdef HM_SANITIZE_THREAD
#include <sanitizer/tsan_interface.h>
#endif

namespace hm {
namespace {

/// Declares the ordering of a loop to ThreadSanitizer, since neither TBB nor this file is instrumented:
/// bodies run after the call and before its return. The bodies are not ordered among themselves, so that
/// races between them are found.
class LoopOrder {
 public:
#ifdef HM_SANITIZE_THREAD
  void begin_loop() { __tsan_release(&began_); }
  void begin_body() { __tsan_acquire(&began_); }
  void end_body() { __tsan_release(&ended_); }
  void end_loop() { __tsan_acquire(&ended_); }

 private:
  char began_ = 0, ended_ = 0;
#else
  void begin_loop() {}
  void begin_body() {}
  void end_body() {}
  void end_loop() {}
#endif
};

}  // namespace

struct ParallelLoop::Impl {
  explicit Impl(int threads)
      : allowance(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)),
        arena(threads) {}
  tbb::global_control allowance;  // more threads than processors is allowed
  tbb::task_arena arena;
};

ParallelLoop::ParallelLoop(int threads) : threads_(threads) {
  HM_CHECK(threads >= 1, "threads = {}", threads);
  if (threads > 1) impl_ = std::make_unique<Impl>(threads);
}
ParallelLoop::~ParallelLoop() = default;
ParallelLoop::ParallelLoop(ParallelLoop&&) noexcept = default;
ParallelLoop& ParallelLoop::operator=(ParallelLoop&&) noexcept = default;

void ParallelLoop::for_ranges(std::size_t count, std::size_t grain,
                              const std::function<void(std::size_t, std::size_t)>& body) const {
  HM_CHECK(grain > 0, "grain = {}", grain);
  const std::size_t ranges = (count + grain - 1) / grain;
  const auto run = [&](std::size_t range) { body(range * grain, std::min(count, (range + 1) * grain)); };
  if (!impl_ || ranges < 2) {
    for (std::size_t range = 0; range < ranges; ++range) run(range);
    return;
  }
  LoopOrder order;
  const auto run_in_order = [&](std::size_t range) {
    order.begin_body();
    run(range);
    order.end_body();
  };
  order.begin_loop();
  impl_->arena.execute(
      [&] { tbb::parallel_for(std::size_t{0}, ranges, run_in_order, tbb::simple_partitioner{}); });
  order.end_loop();
}

int available_threads() { return std::max(1, tbb::this_task_arena::max_concurrency()); }

}  // namespace hm
