#include "hm/core/thread_priority.hpp"

#include <sys/resource.h>

namespace hm {

void set_thread_priority(ThreadPriority priority) {
#ifdef __linux__
  // Linux applies it to the calling thread alone, unlike POSIX. A tenth of the share of a thread at 0.
  constexpr int kNice = 10;
  if (priority == ThreadPriority::kLow) (void)::setpriority(PRIO_PROCESS, 0, kNice);
#else
  (void)priority;
#endif
}

}  // namespace hm
