#pragma once
#include <filesystem>

#include "hm/core/result.hpp"

namespace hm {

/// Lock of a folder that one run writes into (flock of the operating system, which ends with the process). A
/// second lock of the same folder is refused, in this process too.
class FolderLock {
 public:
  /// Makes the folder where it is not there yet, and locks it. Errors (kUsage): it cannot be made, or another
  /// run holds its lock. Where the file system has no locks, nothing is locked and nothing refused.
  static Result<FolderLock> acquire(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&&) = delete;

 private:
  explicit FolderLock(int descriptor) : descriptor_(descriptor) {}

  int descriptor_ = -1;
};

}  // namespace hm
