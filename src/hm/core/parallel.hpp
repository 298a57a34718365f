#pragma once
#include <cstddef>
#include <functional>
#include <memory>

namespace hm {

/// Runs loops on a fixed number of threads. Work is cut into ranges that depend on the item count and
/// grain only, never on the number of threads, so that a loop whose ranges write to separate places
/// gives the same bits for 1 or N threads.
class ParallelLoop {
 public:
  /// threads >= 1; 1 runs everything on the calling thread.
  explicit ParallelLoop(int threads = 1);
  ~ParallelLoop();
  ParallelLoop(ParallelLoop&&) noexcept;
  ParallelLoop& operator=(ParallelLoop&&) noexcept;

  [[nodiscard]] int threads() const { return threads_; }

  /// Calls body(begin, end) for consecutive ranges of at most `grain` items that cover [0, count).
  /// Which thread takes which range is not defined; begin / grain numbers the range.
  void for_ranges(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t begin, std::size_t end)>& body) const;

 private:
  struct Impl;
  int threads_ = 1;
  std::unique_ptr<Impl> impl_;
};

/// The number of threads that this process may run at the same time (at least 1).
int available_threads();

}  // namespace hm
