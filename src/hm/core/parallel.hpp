#pragma once
#include <cstddef>
#include <functional>
#include <memory>

namespace hm {

/// Runs loops on a fixed number of threads. Work is split into ranges that depend only on the item count and
/// grain, never on the number of threads: a loop whose ranges write to separate memory gives bit-identical
/// results for 1 or N threads.
class ParallelLoop {
 public:
  /// threads >= 1; 1 runs everything on the calling thread.
  explicit ParallelLoop(int threads = 1);
  ~ParallelLoop();
  ParallelLoop(ParallelLoop&&) noexcept;
  ParallelLoop& operator=(ParallelLoop&&) noexcept;

  [[nodiscard]] int threads() const { return threads_; }

  /// Calls body(begin, end) for consecutive ranges of at most `grain` items that cover [0, count); blocks
  /// until all are done. The assignment of ranges to threads is undefined; begin / grain is the range's
  /// index.
  void for_ranges(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t begin, std::size_t end)>& body) const;

 private:
  struct Impl;
  int threads_ = 1;
  std::unique_ptr<Impl> impl_;
};

/// Number of threads that this process may run concurrently (at least 1).
int available_threads();

}  // namespace hm
