#pragma once
#include <atomic>
#include <cstddef>

namespace hm {

/// Counts its owner, such as a connection, while it lives. The counter must outlive it.
class Counted {
 public:
  explicit Counted(std::atomic<std::size_t>& counter) : counter_(counter) { ++counter_; }
  ~Counted() { --counter_; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;

 private:
  std::atomic<std::size_t>& counter_;
};

}  // namespace hm
