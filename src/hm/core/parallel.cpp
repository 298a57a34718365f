#include "hm/core/parallel.hpp"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "hm/core/check.hpp"

namespace hm {

struct ParallelLoop::Impl {
  explicit Impl(int threads)
      : allowance(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)), arena(threads) {}
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
  impl_->arena.execute(
      [&] { tbb::parallel_for(std::size_t{0}, ranges, run, tbb::simple_partitioner{}); });
}

int available_threads() { return std::max(1, tbb::this_task_arena::max_concurrency()); }

}  // namespace hm
