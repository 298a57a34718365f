#pragma once
#include <memory>

#include "hm/mapping/map_rebuild.hpp"

namespace hm {

/// Rebuilds the parts of a map moved by loop closures on a separate thread, while frames are still integrated
/// into the map. All functions are called from the map's thread; none waits for a rebuild, except the
/// destructor, for one frame of it.
class LiveMapCorrection {
 public:
  /// `frames` must outlive this object.
  LiveMapCorrection(const DenseParams& parameters, const FrameSource& frames,
                    const MapRebuildOptions& options, ThreadPriority priority = ThreadPriority::kNormal);
  /// Cancels a running rebuild.
  ~LiveMapCorrection();
  LiveMapCorrection(const LiveMapCorrection&) = delete;
  LiveMapCorrection& operator=(const LiveMapCorrection&) = delete;

  [[nodiscard]] bool busy() const;
  /// Starts a rebuild; must not be busy. `pose_now` is called on the other thread. Closes the log's current
  /// group.
  void start(ObservationLog& log, PoseOfObservation pose_now);
  /// Adds a frame that was integrated into the map while busy; must be called for every one.
  void follow(const Observation& observation, std::span<const ChangedVolume> changed, RgbdFrame&& frame);
  /// Returns the rebuild when it is complete, ready to be put into the map, else nothing. The last one or two
  /// frames are processed here, so that it also completes on a busy machine. Not busy afterwards, nor after a
  /// rebuild that ran out of memory.
  std::unique_ptr<MapRebuild> take();
  /// Destroys a rebuild, with the old grid of the map, on the other thread.
  void discard(std::unique_ptr<MapRebuild> rebuild);

  struct State {
    std::size_t frames_done = 0, frames_total = 0;  ///< of the running rebuild
  };
  [[nodiscard]] State state() const;
  /// Reason why a rebuild was given up; empty if none was.
  [[nodiscard]] std::string out_of_memory() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
