#pragma once

namespace hm {

/// Scheduling of a thread among those of this program.
enum class ThreadPriority {
  kNormal,
  kLow,  ///< where processors are short, threads of normal priority go first
};

/// Sets the priority of the calling thread, and of threads that it starts from here on. kLow cannot be taken
/// back. Does nothing where the system does not have priorities of threads.
void set_thread_priority(ThreadPriority priority);

}  // namespace hm
