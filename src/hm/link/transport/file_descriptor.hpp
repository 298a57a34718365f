#pragma once
#include <utility>

#include "hm/core/time.hpp"

namespace hm {

/// Owner of a descriptor of the operating system; -1 is none.
class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int number) : number_(number) {}
  FileDescriptor(FileDescriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    if (this != &other) reset(std::exchange(other.number_, -1));
    return *this;
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  ~FileDescriptor() { reset(); }

  [[nodiscard]] int get() const { return number_; }
  [[nodiscard]] bool is_open() const { return number_ >= 0; }
  /// Closes what is open and takes another one.
  void reset(int number = -1);
  /// Waits until it can be read or was hung up, at most `limit`. False if neither, or if it is not open.
  [[nodiscard]] bool wait_readable(Duration limit) const;

  /// Whether the other side is gone (a terminal that was hung up).
  [[nodiscard]] bool has_hung_up() const;

 private:
  int number_ = -1;
};

}  // namespace hm
