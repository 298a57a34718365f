#include "hm/mapping/live_map_correction.hpp"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <new>
#include <thread>
#include <utility>

#include "hm/core/check.hpp"

namespace hm {
namespace {

constexpr std::size_t kImagesKept = 8;  ///< of waiting frames; others are read again
constexpr std::size_t kFollowedByTaker = 3;

}  // namespace

struct LiveMapCorrection::Impl {
  struct Task {
    ObservationLog log;
    PoseOfObservation pose_now;
  };
  struct Late {
    Observation observation;
    std::vector<VolumeKey> changed;
    std::optional<RgbdFrame> images;
  };

  Impl(const DenseParams& all, const FrameSource& its_frames, const MapRebuildOptions& its_options)
      : parameters(all), frames(its_frames), options(its_options) {}

  DenseParams parameters;
  const FrameSource& frames;
  MapRebuildOptions options;
  mutable std::mutex mutex;  ///< of all below
  std::condition_variable_any changed;
  std::optional<Task> task;
  std::deque<Late> late;
  std::vector<std::unique_ptr<MapRebuild>> discarded;
  std::unique_ptr<MapRebuild> complete;  ///< the worker waits while it is set and nothing is late
  bool busy = false;
  State state;
  std::string out_of_memory;
  std::jthread worker;  // last: stops before the other members are destroyed

  void work(const std::stop_token& stop);
  std::unique_ptr<MapRebuild> rebuild(const Task& with, const std::stop_token& stop);
  void give_up(const std::string& why);
  void catch_up(std::unique_lock<std::mutex>& lock, const std::stop_token& stop);
};

std::unique_ptr<MapRebuild> LiveMapCorrection::Impl::rebuild(const Task& with, const std::stop_token& stop) {
  auto result = std::make_unique<MapRebuild>(parameters, frames, options);
  RunContext run;
  run.stop = stop;
  run.progress = [this](const Progress& progress) {
    const std::scoped_lock lock(mutex);
    state = {progress.done, progress.total};
  };
  try {
    if (result->replay(with.log, with.pose_now, run)) return result;
  } catch (const std::bad_alloc&) {
    result.reset();
    const std::scoped_lock lock(mutex);
    give_up("out of memory: a part of the map does not fit beside the map");
    return nullptr;
  }
  const std::scoped_lock lock(mutex);
  if (!result->report().out_of_memory.empty()) give_up(result->report().out_of_memory);
  return nullptr;
}

/// Called with the mutex held.
void LiveMapCorrection::Impl::give_up(const std::string& why) {
  out_of_memory = why;
  busy = false;
  late.clear();
}

/// Adds frames that arrived in the meantime until the rebuild is taken.
void LiveMapCorrection::Impl::catch_up(std::unique_lock<std::mutex>& lock, const std::stop_token& stop) {
  while (complete && !stop.stop_requested()) {
    if (late.empty()) {
      changed.wait(lock, stop, [this] { return !complete || !late.empty(); });
      continue;
    }
    Late next = std::move(late.front());
    late.pop_front();
    auto mine = std::move(complete);  // cannot be taken in the meantime
    lock.unlock();
    mine->follow(next.observation, next.changed, std::move(next.images));
    lock.lock();
    if (!mine->report().out_of_memory.empty()) return give_up(mine->report().out_of_memory);
    complete = std::move(mine);
  }
}

void LiveMapCorrection::Impl::work(const std::stop_token& stop) {
  std::unique_lock lock(mutex);
  while (true) {
    changed.wait(lock, stop, [this] { return task || !discarded.empty(); });
    if (stop.stop_requested()) return;
    auto garbage = std::exchange(discarded, {});
    const auto now = std::exchange(task, {});
    lock.unlock();
    garbage.clear();
    auto done = now ? rebuild(*now, stop) : nullptr;
    lock.lock();
    complete = std::move(done);
    catch_up(lock, stop);
  }
}

std::string LiveMapCorrection::out_of_memory() const {
  const std::scoped_lock lock(impl_->mutex);
  return impl_->out_of_memory;
}

LiveMapCorrection::LiveMapCorrection(const DenseParams& parameters, const FrameSource& frames,
                                     const MapRebuildOptions& options, ThreadPriority priority)
    : impl_(std::make_unique<Impl>(parameters, frames, options)) {
  impl_->worker = std::jthread([impl = impl_.get(), priority](const std::stop_token& stop) {
    set_thread_priority(priority);
    impl->work(stop);
  });
}
LiveMapCorrection::~LiveMapCorrection() = default;

bool LiveMapCorrection::busy() const {
  const std::scoped_lock lock(impl_->mutex);
  return impl_->busy;
}

void LiveMapCorrection::start(ObservationLog& log, PoseOfObservation pose_now) {
  log.close();
  const std::scoped_lock lock(impl_->mutex);
  HM_CHECK(!impl_->busy, "a rebuild is under way");
  impl_->busy = true;
  impl_->state = {};
  impl_->task = Impl::Task{log, std::move(pose_now)};
  impl_->changed.notify_all();
}

void LiveMapCorrection::follow(const Observation& observation, std::span<const ChangedVolume> changed,
                               RgbdFrame&& frame) {
  Impl::Late late{observation, {}, {}};
  for (const ChangedVolume& volume : changed) late.changed.push_back(volume.key);
  const std::scoped_lock lock(impl_->mutex);
  if (!impl_->busy) return;
  if (impl_->late.size() < kImagesKept) late.images = std::move(frame);
  impl_->late.push_back(std::move(late));
  impl_->changed.notify_all();
}

std::unique_ptr<MapRebuild> LiveMapCorrection::take() {
  std::unique_lock lock(impl_->mutex);
  if (!impl_->complete || impl_->late.size() > kFollowedByTaker) return nullptr;
  impl_->busy = false;
  auto taken = std::move(impl_->complete);
  auto late = std::exchange(impl_->late, {});
  impl_->changed.notify_all();
  lock.unlock();
  for (Impl::Late& next : late) taken->follow(next.observation, next.changed, std::move(next.images));
  if (taken->report().out_of_memory.empty()) return taken;
  lock.lock();
  impl_->give_up(taken->report().out_of_memory);
  return nullptr;
}

void LiveMapCorrection::discard(std::unique_ptr<MapRebuild> rebuild) {
  const std::scoped_lock lock(impl_->mutex);
  impl_->discarded.push_back(std::move(rebuild));
  impl_->changed.notify_all();
}

LiveMapCorrection::State LiveMapCorrection::state() const {
  const std::scoped_lock lock(impl_->mutex);
  return impl_->state;
}

}  // namespace hm
