#include "hm/io/bytes/folder_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "hm/io/bytes/output_file.hpp"

namespace hm {

Result<FolderLock> FolderLock::acquire(const std::filesystem::path& folder) {
  if (const auto made = make_folder(folder); !made) return forward_error(made);
  FolderLock lock(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (lock.descriptor_ < 0 || ::flock(lock.descriptor_, LOCK_EX | LOCK_NB) == 0) return lock;
  if (errno != EWOULDBLOCK) return lock;  // a file system without locks
  return fail(ErrorCode::kUsage, folder.string(),
              "another run writes into this folder now: wait until it ends, or give another folder with -o");
}

FolderLock::FolderLock(FolderLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace hm
